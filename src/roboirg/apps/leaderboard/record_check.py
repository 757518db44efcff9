"""Compare a record with what its actions and this version of the benchmark lead to."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from roboirg.apps.leaderboard.action_replay import job_of, replay
from roboirg.core.errors import RoboIRGError
from roboirg.core.versions import WORDS
from roboirg.evaluation.play.episode_record import begin_record
from roboirg.evaluation.play.job_instruction import (
    PreparedJob,
    has_other_words,
    installed_words,
    other_versions,
)
from roboirg.evaluation.records.action_log import ActionLog, read_actions
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.record_codec import read_record
from roboirg.evaluation.records.store import RECORDS_FILE

TOLERANCE = 0.02
"""Largest difference of an end state, in m, rad and s, that is granted to a record from another
family of processors: ten times the largest on an emulated one. Events and steps must be equal."""

WORD_FIELDS = ("seed", "difficulty", "mentions", "command", "goal", "metadata", "words")
"""Fields that follow from the job alone."""

PLAYED_FIELDS = (
    "outcome",
    "error",
    "cause",
    "goals",
    "steps",
    "demonstration_steps",
    "demonstration_source",
    "events",
    "instruction",
)
"""Fields that follow from the job and the actions."""
ATTRIBUTED_FIELDS = ("attribution", "attempts")
"""Those that do only if attempts were watched for, and given what the policy declared."""
# Of all these, those that follow from words, which cannot be checked if others are installed.
_HEARD_FIELDS = ("mentions", "command", "metadata", "words", "instruction", "attribution")

_MOST_SHOWN = 160


ReplayVerdict = Literal["exact", "tolerant", "different", "not replayed"]
"""How the end of an episode compares with the record's: equal, bit for bit; equal but for
`TOLERANCE`, and the record is from a processor of another family, or does not report it; not equal;
not in the sample, or an error that kept no actions."""


class RecordCheck(NamedTuple):
    """Result of checking one record.

    Attributes:
        slug: of the record's job.
        findings: what does not hold, one sentence each.
        replayed: how its end compares.
        deviation: largest difference of the end state, in m, rad and s.
        elsewhere: whether only what follows from the motion does not hold, and the record is from a
            processor of another family, or does not report it.
    """

    slug: str
    findings: tuple[str, ...]
    replayed: ReplayVerdict = "not replayed"
    deviation: float = 0.0
    elsewhere: bool = False


class LineToCheck(NamedTuple):
    """A line of a records file, and whether its actions are played."""

    number: int
    line: bytes
    play: bool


def check_line(one: LineToCheck, folder: Path) -> RecordCheck:
    """Check one record of a run's folder.

    Raises:
        StoreError: the line is not a record.
    """
    record = read_record(one.line, folder / RECORDS_FILE, one.number)
    try:
        return _check(record, folder, play=one.play)
    except RoboIRGError as error:
        return RecordCheck(record.slug, (str(error),))


def _names_words(record: Record) -> bool:
    """Return whether a record names the words that it should have, of whatever version.

    Only these excuse from checking what was said; a language whose words are code has none.
    """
    installed = installed_words(record)
    if not installed:
        return False
    name, _, _ = installed.partition("@")
    return re.fullmatch(rf"{re.escape(name)}@[0-9a-f]+", record.words_version) is not None


def _check(record: Record, folder: Path, *, play: bool) -> RecordCheck:
    findings = [
        f"{what.replace(' ', '_')}: the record says {recorded}; this roboirg checks {installed}."
        for what, recorded, installed in other_versions(record)
        if what != WORDS
    ]
    other_words = has_other_words(record)
    if other_words and not _names_words(record):
        findings.append(
            f"words: the record says {record.words_version!r}, which are no words of "
            f"{record.words_owner}."
        )
    if findings:
        return RecordCheck(record.slug, tuple(findings))
    log = None if record.action_log is None else read_actions(folder, record.action_log)
    if log is not None and play:
        again, played = replay(record, log)
    else:
        again = begin_record(PreparedJob(job_of(record)))
        played = None
    if other_words:
        for name in _HEARD_FIELDS:
            setattr(record, name, getattr(again, name))
    findings = list(_differences(record, again, WORD_FIELDS))
    if log is None and record.outcome != "error":
        findings.append("Its actions were not kept, so the verdict cannot be checked.")
    if log is None or not play:
        return RecordCheck(record.slug, (*findings, *_words(record, again)))
    elsewhere = record.processor != again.processor
    may_move_differently = elsewhere and not findings
    watched = ATTRIBUTED_FIELDS if record.attempts is not None else ()
    findings += _differences(record, again, (*PLAYED_FIELDS, *watched))
    if played is None:
        findings.append("actions: when played again, the episode takes none.")
        return RecordCheck(record.slug, tuple(findings), "different", float("inf"))
    verdict, deviation = _compare_ends(record, again, log, played, elsewhere=elsewhere)
    if verdict == "different":
        findings.append(f"end_state: when played again, it differs by {deviation:.2g} (m, rad, s).")
    is_as_long = len(played.rows) == len(log.rows)
    if not (is_as_long and np.array_equal(played.requests, log.requests)):
        findings.append("actions: some of them come after the end of the episode.")
    return RecordCheck(record.slug, tuple(findings), verdict, deviation, may_move_differently)


def _words(record: Record, unplayed: Record) -> Iterator[str]:
    """Yield where the utterances differ; not played, the steps at which they are heard are open."""
    recorded, expected = (
        tuple((one.stage, one.text) for one in each.instruction) for each in (record, unplayed)
    )
    if recorded != expected:
        yield _difference("instruction", recorded, expected)


def _differences(record: Record, again: Record, fields: tuple[str, ...]) -> Iterator[str]:
    for name in fields:
        recorded = getattr(record, name)
        expected = getattr(again, name)
        if recorded != expected:
            yield _difference(name, recorded, expected)


def _difference(name: str, recorded: object, expected: object) -> str:
    return f"{name}: the record says {_short(recorded)}; it should be {_short(expected)}."


def _short(value: object) -> str:
    if isinstance(value, tuple) and len(value) > 1:
        return f"{len(value)} entries, the last {_short(value[-1])}"
    text = repr(value)
    return text if len(text) <= _MOST_SHOWN else f"{text[:_MOST_SHOWN]}…"


def _compare_ends(
    record: Record, again: Record, log: ActionLog, played: ActionLog, *, elsewhere: bool
) -> tuple[ReplayVerdict, float]:
    """Return how the ends compare, and their largest difference.

    The numbers of the log can be equal where the hash, which covers more, is not, and the reverse
    where a record was forged; both are a different end.
    """
    if played.end_state.shape != log.end_state.shape:
        return "different", float("inf")
    deviation = float(np.max(np.abs(played.end_state - log.end_state), initial=0.0))
    if deviation == 0.0:
        return "exact" if record.end_state == again.end_state else "different", 0.0
    within = deviation <= TOLERANCE and record.end_state != again.end_state
    return "tolerant" if elsewhere and within else "different", deviation
