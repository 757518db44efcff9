"""Compare a record with what its actions and this version of the benchmark lead to.

What follows from the job alone, such as the words, is made again; what follows from the actions is
checked by playing them again. Each difference is a *finding*, one sentence.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, NamedTuple

import msgspec
import numpy as np

from roboirg.apps.leaderboard.action_replay import prepared_job, replay
from roboirg.core.errors import RoboIRGError
from roboirg.core.versions import WORDS
from roboirg.records.action_log import ActionLog, read_actions
from roboirg.records.record import Record, UtteranceRecord
from roboirg.records.record_codec import read_record
from roboirg.records.store import RECORDS_FILE
from roboirg.runs.job_instruction import (
    has_other_words,
    installed_words,
    other_versions,
)
from roboirg.runs.play.episode_record import begin_record

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
    "attempts",
    "attribution",
)
"""Fields that follow from the job, the actions, and what the policy declared."""
_WORD_FACTS = ("metadata", "words", "attribution")
"""Of all these, those that follow from words, which cannot be checked if others are installed. What
was said is then taken from the record, and only when it was heard is checked."""

_MOST_SHOWN = 1000
"""Characters of a value in a finding."""


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


def check_line(line: LineToCheck, folder: Path) -> RecordCheck:
    """Check one record of a run's folder; runs in a worker process.

    An error of the package, such as damaged actions, becomes a finding.

    Raises:
        StoreError: the line is not a record.
    """
    record = read_record(line.line, folder / RECORDS_FILE, line.number)
    try:
        return _check(record, folder, play=line.play)
    except RoboIRGError as error:
        return RecordCheck(record.slug, (str(error),))


def _names_words(record: Record) -> bool:
    """Return whether a record names words of its own task and pool, of whatever version.

    ``PickXtimes/test@1a2b`` where ``PickXtimes/test@9f8e`` is installed -> True. Only these excuse
    from checking what was said.
    """
    installed = installed_words(record) or ""
    name, _, _ = installed.partition("@")
    return re.fullmatch(rf"{re.escape(name)}@[0-9a-f]+", record.words) is not None


def _check(record: Record, folder: Path, *, play: bool) -> RecordCheck:
    """Check a record: first its versions, then, if they are the installed ones, all that follows.

    Args:
        record: of the run; a part of it may be changed here (`_excuse_words`).
        folder: of the run, which has the actions.
        play: whether to play its actions again, if it has any.
    """
    findings = tuple(_version_findings(record))
    if findings:  # other versions have other worlds and words, so nothing else can be compared
        return RecordCheck(record.slug, findings)
    log = None if record.action_log is None else read_actions(folder, record.action_log)
    if log is None or not play:
        return _check_unplayed(record, has_actions=log is not None)
    return _check_played(record, log)


def _version_findings(record: Record) -> Iterator[str]:
    """Yield a finding, a sentence, for each version of a record that is not the installed one.

    Words may be those of another version, which are then not checked, but they must be words of the
    record's own task and pool.
    """
    for what, recorded, installed in other_versions(record):
        if what != WORDS:
            name = what.replace(" ", "_")
            yield f"{name}: the record says {recorded}; this roboirg checks {installed}."
    if has_other_words(record) and not _names_words(record):
        yield (
            f"words: the record says {record.words!r}, which are no words of {record.words_owner}."
        )
    if record.words != record.metadata.get("words"):
        yield _difference("words", record.words, record.metadata.get("words"))


def _check_unplayed(record: Record, *, has_actions: bool) -> RecordCheck:
    """Check what follows from the job of a record alone, such as its scene and its words.

    Without actions, the verdict of a record that is no error cannot be checked, which is a finding.
    """
    expected = begin_record(prepared_job(record))
    _excuse_words(record, expected)
    findings = list(_differences(record, expected, WORD_FIELDS))
    if not has_actions and record.outcome != "error":
        findings.append("Its actions were not kept, so the verdict cannot be checked.")
    # Compared without the steps at which they are heard, which only playing would show.
    said = _utterances(record)
    to_say = _utterances(expected)
    if said != to_say:
        findings.append(_difference("instruction", said, to_say))
    return RecordCheck(record.slug, tuple(findings))


def _check_played(record: Record, log: ActionLog) -> RecordCheck:
    """Play the actions of a record again, and check all that follows from job and actions."""
    again, played = replay(record, log)
    _excuse_words(record, again)
    word_findings = list(_differences(record, again, WORD_FIELDS))
    findings = [*word_findings, *_differences(record, again, PLAYED_FIELDS)]
    if played is None:
        findings.append("actions: when played again, the episode takes none.")
        return RecordCheck(record.slug, tuple(findings), "different", float("inf"))

    is_elsewhere = record.processor != again.processor
    deviation = _deviation(log, played)
    has_same_hash = record.end_state == again.end_state
    verdict = _verdict(deviation, has_same_hash=has_same_hash, is_elsewhere=is_elsewhere)
    if verdict == "different":
        findings.append(_end_finding(record, log, again, played))
    findings += _surplus_findings(log, played)
    # On another kind of processor contacts can end differently. That excuses what follows from
    # the motion, but no finding about words.
    may_move_differently = is_elsewhere and not word_findings
    return RecordCheck(record.slug, tuple(findings), verdict, deviation, may_move_differently)


def _end_finding(record: Record, log: ActionLog, again: Record, played: ActionLog) -> str:
    """Return the finding that the end state of a record is not that of playing it again.

    Args:
        record: as stored, with the hash of its end state.
        log: its actions, with the numbers of its end state.
        again: the record of playing it again.
        played: the actions of playing it again.
    """
    # The hash covers more than the numbers, so it is compared after them.
    stored_end = (*log.end_state.tolist(), record.end_state)
    played_end = (*played.end_state.tolist(), again.end_state)
    return _difference("end_state", stored_end, played_end)


def _surplus_findings(log: ActionLog, played: ActionLog) -> Iterator[str]:
    """Yield a finding if the episode takes other actions than are stored, such as fewer."""
    is_as_long = len(played.rows) == len(log.rows)
    if not (is_as_long and np.array_equal(played.requests, log.requests)):
        yield (
            "actions: some of them come after the end of the episode, which takes "
            f"{len(played.rows)} of {len(log.rows)}."
        )


def _excuse_words(record: Record, expected: Record) -> None:
    """Overwrite what `record` says of other words than the installed ones by what is expected.

    So comparing the two finds no difference there.
    """
    if has_other_words(record):
        for name in _WORD_FACTS:
            setattr(record, name, getattr(expected, name))


def _deviation(log: ActionLog, played: ActionLog) -> float:
    """Return the largest difference of two end states (m, rad, s); infinite if sizes differ."""
    if played.end_state.shape != log.end_state.shape:
        return float("inf")
    return float(np.max(np.abs(played.end_state - log.end_state), initial=0.0))


def _verdict(deviation: float, *, has_same_hash: bool, is_elsewhere: bool) -> ReplayVerdict:
    """Return how the end state of a record compares with that of its actions played again.

    Numbers and hash of an end state are stored next to each other, and both are compared: the hash
    covers more than the numbers, and in a forged record it may stay while the numbers change.

    Args:
        deviation: largest difference of the numbers.
        has_same_hash: whether the hashes are equal.
        is_elsewhere: whether the record is of another kind of processor; only then may the numbers
            differ by up to `TOLERANCE`.

    Returns:
        ``exact``: numbers and hash are equal; ``tolerant``: both differ, the numbers by little;
            ``different``: all else, also numbers and hash that contradict each other.
    """
    if deviation == 0.0 and has_same_hash:
        return "exact"
    if 0.0 < deviation <= TOLERANCE and is_elsewhere and not has_same_hash:
        return "tolerant"
    return "different"


def _utterances(record: Record) -> tuple[UtteranceRecord, ...]:
    """Return the utterances of a record without the steps at which they were heard."""
    return tuple(msgspec.structs.replace(said, step=None) for said in record.instruction)


def _differences(record: Record, expected: Record, fields: tuple[str, ...]) -> Iterator[str]:
    """Yield a finding for each field in which a record is not as expected."""
    for name in fields:
        value = getattr(record, name)
        expected_value = getattr(expected, name)
        if value != expected_value:
            yield _difference(name, value, expected_value)


def _difference(place: str, recorded: object, expected: object) -> str:
    """Return a finding that names where two values first differ, and what stands there in both.

    If the second of three events differs, that is ``events, entry 2: the record says Event(…); it
    should be Event(…).`` In mappings the place is named by its key, ``goal.count``. What is missing
    in one of them is None.
    """
    if isinstance(recorded, tuple) and isinstance(expected, tuple):
        pairs = itertools.zip_longest(recorded, expected)
        for number, (entry, expected_entry) in enumerate(pairs, start=1):
            if entry != expected_entry:
                return _difference(f"{place}, entry {number}", entry, expected_entry)
    if isinstance(recorded, dict) and isinstance(expected, dict):
        for key in {**recorded, **expected}:
            if recorded.get(key) != expected.get(key):
                return _difference(f"{place}.{key}", recorded.get(key), expected.get(key))
    return f"{place}: the record says {_short(recorded)}; it should be {_short(expected)}."


def _short(value: object) -> str:
    """Return a value as a text of limited length."""
    text = repr(value)
    return text if len(text) <= _MOST_SHOWN else f"{text[:_MOST_SHOWN]}…"
