"""The same run played twice: which verdicts and actions changed."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.stats.flips import FLIPS_FILE, FlipCounts, Flips
from roboirg.evaluation.records.action_log import ActionLog, read_actions
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.record_codec import identity_key, read_summary
from roboirg.evaluation.records.store import StoredRun
from roboirg.util.atomic_write import write_atomically

_ARITHMETIC = ("device", "driver", "flags")


class RepeatedEpisode(NamedTuple):
    """One episode in two runs of the same policy.

    Attributes:
        policy: its name.
        options: of the instruction.
        slug: of the job.
        outcomes: success, failure or error, first and second.
        differs_at: index of the first action that differs; None if all are equal, or were not kept.
        arithmetic: device, driver and flags that the policy's server reported, first and second;
            empty texts if it reported none.
    """

    policy: str
    options: InstructionOptions
    slug: str
    outcomes: tuple[str, str]
    differs_at: int | None
    arithmetic: tuple[str, str] = ("", "")

    @property
    def is_flip(self) -> bool:
        """Whether one run succeeded and the other failed."""
        return set(self.outcomes) == {"success", "failure"}


def repeated_episodes(first: Path, second: Path) -> tuple[RepeatedEpisode, ...]:
    """Return the episodes that are in two runs, in the order of the first.

    Raises:
        StoreError: a run has no records, or a line is not a record.
        InvalidValueError: the runs have no episode in common.
    """
    ours, theirs = (StoredRun(folder, read_summary) for folder in (first, second))
    there = {identity_key(one): one for one in theirs.newest}
    wanted = [one for one in ours.newest if identity_key(one) in there]
    if not wanted:
        raise InvalidValueError(f"{first} and {second} have no episode in common.")
    again = theirs.records(there[identity_key(one)] for one in wanted)
    return tuple(
        _compared(one, other, first, second)
        for one, other in zip(ours.records(wanted), again, strict=True)
    )


def count_flips(episodes: Iterable[RepeatedEpisode]) -> FlipCounts:
    """Count outcomes over repeated episodes."""
    found = list(episodes)
    pairs = [one.outcomes for one in found]
    judged = [one for one in found if "error" not in one.outcomes]
    return FlipCounts(
        both=pairs.count(("success", "success")),
        neither=pairs.count(("failure", "failure")),
        lost=pairs.count(("success", "failure")),
        gained=pairs.count(("failure", "success")),
        acted_differently=sum(one.differs_at is not None for one in judged),
        errors=len(found) - len(judged),
    )


def flips_by_cell(episodes: Sequence[RepeatedEpisode]) -> Flips:
    """Count outcomes for each policy and kind of instruction."""
    cells: dict[tuple[str, InstructionOptions], list[RepeatedEpisode]] = defaultdict(list)
    for one in episodes:
        cells[one.policy, one.options].append(one)
    return {key: count_flips(found) for key, found in cells.items()}


def write_flips(found: Flips, folder: Path) -> None:
    """Keep in the folder of a run how often its policies' verdicts change."""
    rows = [
        {"policy": policy, "options": asdict(options), "counts": asdict(counts)}
        for (policy, options), counts in found.items()
    ]
    write_atomically(folder / FLIPS_FILE, json.dumps(rows, indent=1) + "\n")


def told_arithmetic(metadata: Mapping[str, Any]) -> str:
    """Return device, driver and flags among a policy's metadata, in words; empty without any."""
    inner = metadata.get("policy")
    told = {**(inner if isinstance(inner, Mapping) else {}), **metadata}
    return ", ".join(f"{name} {told[name]}" for name in _ARITHMETIC if told.get(name))


def _compared(one: Record, other: Record, first: Path, second: Path) -> RepeatedEpisode:
    differs_at = None
    if one.action_log != other.action_log and one.action_log and other.action_log:
        logs = read_actions(first, one.action_log), read_actions(second, other.action_log)
        differs_at = _first_difference(*logs)
    return RepeatedEpisode(
        policy=one.policy,
        options=one.column,
        slug=one.slug,
        outcomes=(one.outcome, other.outcome),
        differs_at=differs_at,
        arithmetic=(told_arithmetic(one.policy_metadata), told_arithmetic(other.policy_metadata)),
    )


def _first_difference(one: ActionLog, other: ActionLog) -> int | None:
    """Return the index of the first action that differs; None if only the end state does."""
    if one.rows.shape[1:] != other.rows.shape[1:]:
        return 0
    shared = min(len(one.rows), len(other.rows))
    different = np.flatnonzero((one.rows[:shared] != other.rows[:shared]).any(axis=1))
    if len(different):
        return int(different[0])
    return None if len(one.rows) == len(other.rows) else shared
