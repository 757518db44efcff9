"""The sentences below a table: what its signs mean, and all that is amiss with the run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from roboirg.analysis.published import TRIALS, RateTable
from roboirg.analysis.stats.samples import CellResults, PolicyRun, Samples
from roboirg.analysis.stats.success_rates import SETTING_ORDER, SettingColumn
from roboirg.analysis.tables.table import (
    ERROR_MARK,
    MISSING_MARK,
    NOT_APPLICABLE,
    PARTIAL_MARK,
    Entry,
    Row,
)
from roboirg.language import STAGE_SETS

RATES_NOTE = (
    "Success rate in percent, the mean over policy seeds; averages are unweighted means over tasks."
)
ARROWS = {"up": "↑", "down": "↓", "same": "→"}


def notes_of(
    which: RateTable, rows: Sequence[Row], samples: Samples, tasks: Sequence[str]
) -> tuple[str, ...]:
    """The notes of a table of rates."""
    ours = {
        key: sample for key, sample in samples.items() if key[1] in tasks and _told(which, key[2])
    }
    entries = [entry for row in rows for entry in row.entries]
    return (
        RATES_NOTE,
        *_signs(which, entries),
        *_numbers(ours.values()),
        *_amiss(ours.values(), entries),
        *_company(ours),
        *_left_out(which, samples, tasks),
        *_published(which, rows),
    )


def _told(which: RateTable, variant: SettingColumn) -> bool:
    if which == "context":
        stages = variant.stages
        return variant == SettingColumn("contextual", stages=stages) and stages in STAGE_SETS
    return variant == SettingColumn(variant.setting) and variant.setting in SETTING_ORDER


def _signs(which: RateTable, entries: Iterable[Entry]) -> list[str]:
    found = list(entries)
    notes = []
    if any(entry.change for entry in found):
        than = "the shortest context" if which == "context" else "explicit"
        notes.append(
            f"{ARROWS['up']} above, {ARROWS['down']} below, {ARROWS['same']} equal to {than} of "
            "the same policy, as printed, on the same tasks; an arrow does not say that the "
            "difference is more than chance."
        )
    if any(entry.best for entry in found):
        notes.append("Bold: the best of its group.")
    if any(not entry.applies for entry in found):
        notes.append(f"{NOT_APPLICABLE} the setting is not defined for the task.")
    return notes


def _numbers(samples: Iterable[CellResults]) -> list[str]:
    judged = [sample for sample in samples if sample.trials]
    if not judged:
        return []
    episodes = _span(len(sample.by_episode()) for sample in judged)
    trials = _span(sample.trials for sample in judged)
    if episodes == trials:
        return [f"{episodes} episodes per cell, each played once."]
    return [f"{episodes} episodes and {trials} trials per cell: several policy seeds."]


def _amiss(samples: Iterable[CellResults], entries: Iterable[Entry]) -> list[str]:
    found = list(samples)
    notes = []
    errors, missing = sum(one.errors for one in found), sum(one.missing for one in found)
    if errors:
        notes.append(f"{ERROR_MARK} {_trials(errors)} ended in an error and are in no rate.")
    if missing:
        notes.append(f"{MISSING_MARK} {_trials(missing)} of the plan are still to be played.")
    if any(PARTIAL_MARK in entry.marks for entry in entries):
        notes.append(
            f"{PARTIAL_MARK} an average over what there is: a task is incomplete or was not played."
        )
    if errors or missing:
        notes.append("What is incomplete has no arrow, and its column no best.")
    return notes


def _company(samples: Samples) -> list[str]:
    """Whether there is somebody to compare with, and whether that is fair."""
    notes = []
    contestants = list(dict.fromkeys(who for who, _, _ in samples))
    if len({who.policy for who in contestants}) == 1 and len(contestants) == 1:
        notes.append("One policy was played; there is none to compare it with.")
    for name in ("language", "environment"):
        versions = _versions(contestants, name)
        if len(versions) > 1:
            notes.append(
                f"Results of several {name} versions ({', '.join(versions)}) stand apart: they are "
                "not comparable."
            )
    policies = {who.policy for who in contestants}
    for policy in sorted(policies):
        versions = _versions([who for who in contestants if who.policy == policy], "policy")
        if len(versions) > 1:
            notes.append(f"Several versions of {policy} ({', '.join(versions)}) stand apart.")
    if any(
        len({who.rules for who in contestants if who.policy == policy}) > 1 for policy in policies
    ):
        notes.append("What was played under different rules stands apart.")
    return notes


def _versions(contestants: Iterable[PolicyRun], name: str) -> list[str]:
    return sorted({str(getattr(who.versions, name)) for who in contestants if who.versions})


def _left_out(which: RateTable, samples: Samples, tasks: Sequence[str]) -> list[str]:
    tasks_out = sorted({task for _, task, _ in samples if task not in tasks})
    told_out = sorted(
        {told.label for _, task, told in samples if task in tasks and not _told(which, told)}
    )
    notes = []
    if which == "main" and tasks_out:
        notes.append(f"Not in this table: the results of {', '.join(tasks_out)}.")
    if which == "main" and told_out:
        notes.append(f"Not in this table: what was told as {'; '.join(told_out)}.")
    return notes


def _published(which: RateTable, rows: Iterable[Row]) -> list[str]:
    if not any(row.source == "published" for row in rows):
        return []
    episodes, seeds = TRIALS[which]
    trials = f"{episodes} trials" if seeds == 1 else f"{episodes} episodes × {seeds} seeds"
    suites = " The averages of suites are ours." if which == "main" else ""
    return [
        f"(published): from the paper, {trials} per cell, played in its own simulator.{suites}"
        if which != "real"
        else f"(published): from the paper, {trials} per cell on its own robot."
    ]


def _trials(count: int) -> str:
    return f"{count} trial{'' if count == 1 else 's'}"


def _span(values: Iterable[int]) -> str:
    found = list(values)
    low, high = min(found), max(found)
    return str(low) if low == high else f"{low} to {high}"
