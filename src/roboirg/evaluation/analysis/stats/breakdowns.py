"""What gaps are broken down by: names for kinds of instructions, and cells of one kind."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from roboirg.core.arms import TOLD
from roboirg.core.errors import UnknownNameError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.stats.cells import CellKey, CellResults, Cells, Trial
from roboirg.evaluation.records.record import Record
from roboirg.language.settings import EXPLICIT

UNKNOWN = "unknown"
"""Label of instructions whose records do not say what is asked."""
RIVAL, NO_RIVAL = "recency rival", "no recency rival"
COMPETING = "competing distractor"
SINGLED = "one of two"
"""Before the kind of words that single out one of two values."""


class Breakdown(NamedTuple):
    """One way to break results down.

    Attributes:
        name: in the command line and in file names.
        title: heading of the labels.
        labels: returns the labels of an instruction: none if the question does not apply to it,
            `UNKNOWN` if its record does not answer it. With several labels it counts in each.
        note: what the labels mean, a sentence.
        in_explicit: whether explicit instructions are broken down, too.
    """

    name: str
    title: str
    labels: Callable[[Record], tuple[str, ...]]
    note: str
    in_explicit: bool = False


class InstructionKey(NamedTuple):
    """What the words of an instruction depend on: not on the policy, nor on its seed."""

    task: str
    split: str
    episode: int
    options: InstructionOptions
    language_version: str
    environment_version: int
    arm: str = TOLD

    @classmethod
    def of(cls, record: Record) -> InstructionKey:
        return cls(**{name: getattr(record, name) for name in cls._fields})

    @classmethod
    def of_trial(cls, key: CellKey, trial: Trial) -> InstructionKey:
        """Return the key of the instruction that was played in a trial."""
        conditions, versions = key.policy_run.conditions, key.policy_run.versions
        if versions is None:
            raise ValueError(f"{key.policy_run.policy} has not played {key.task}.")
        return cls(
            key.task,
            conditions.split,
            trial.episode,
            replace(key.options, wordings=conditions.wordings),
            versions.language,
            versions.environment,
            conditions.arm,
        )


Labels = Mapping[InstructionKey, tuple[str, ...]]
"""The labels of instructions."""


def _pattern(record: Record) -> tuple[str, ...]:
    pattern = record.metadata.get("pattern", UNKNOWN)
    return () if pattern is None else (str(pattern),)


def _expressions(record: Record) -> tuple[str, ...]:
    """Return the classes of the command's anaphors; those of the context add no referent."""
    if not record.mentions:
        return (UNKNOWN,)
    last = len(record.instruction) - 1
    found = (one.expression for one in record.mentions if one.utterance == last)
    return tuple(dict.fromkeys(one for one in found if one is not None))


def _slots(record: Record) -> tuple[str, ...]:
    hidden = record.metadata.get("hidden_slots", UNKNOWN)
    return (str(hidden),) if hidden else ()


def _reference(record: Record) -> tuple[str, ...]:
    """Return how an instruction with a rival singles one of the two values out."""
    reference = record.metadata.get("rival_reference")
    return () if reference is None else (f"{SINGLED}: {reference}",)


def _rival(record: Record) -> tuple[str, ...]:
    metadata, expressions = record.metadata, _expressions(record)
    distractor = metadata.get("distractor", UNKNOWN)
    if distractor is None:
        return ()
    if UNKNOWN in (distractor, *expressions):
        return (UNKNOWN,)
    if "it" not in expressions:
        return ()
    if distractor == "competing":
        return (COMPETING,)
    if "recency_rival" not in metadata:
        return (UNKNOWN,)
    return (NO_RIVAL if metadata["recency_rival"] is None else RIVAL,)


BREAKDOWNS: Mapping[str, Breakdown] = {
    one.name: one
    for one in (
        Breakdown(
            "pattern",
            "reasoning pattern",
            _pattern,
            "Each episode counts in its main pattern.",
        ),
        Breakdown(
            "expression",
            "referring expression",
            _expressions,
            "An episode counts in each class of expression that its command has.",
        ),
        Breakdown(
            "slots",
            "hidden slots",
            _slots,
            "Hidden slots are the values of the goal that the command leaves to its context.",
        ),
        Breakdown(
            "rival",
            "recency rival",
            lambda record: _reference(record) or _rival(record),
            "Commands that say “it”: with a recency rival, the last remark before the command is "
            "about another thing. With a rival: how the words single out one of two values.",
        ),
        Breakdown(
            "difficulty",
            "difficulty",
            lambda record: (record.difficulty,),
            "The difficulty is that of the scene: its number of things, swaps or repetitions.",
            in_explicit=True,
        ),
    )
}


def find_breakdowns(names: Iterable[str]) -> tuple[Breakdown, ...]:
    wanted = tuple(names)
    for name in wanted:
        if name not in BREAKDOWNS:
            raise UnknownNameError("breakdown", name, BREAKDOWNS)
    return tuple(BREAKDOWNS[name] for name in dict.fromkeys(wanted))


def label_instructions(
    breakdowns: Sequence[Breakdown], records: Iterable[Record]
) -> dict[str, Labels]:
    """Return the labels of all instructions by the name of the breakdown.

    Reads one record after the other and keeps none. The same instruction in a record that answers
    the question and in an older one that does not has the known labels.
    """
    found: dict[str, dict[InstructionKey, tuple[str, ...]]] = {one.name: {} for one in breakdowns}
    for record in records:
        key = InstructionKey.of(record)
        for breakdown in breakdowns:
            is_asked = breakdown.in_explicit or record.setting != EXPLICIT
            labels = breakdown.labels(record) if is_asked else ()
            own = found[breakdown.name]
            if labels != (UNKNOWN,) or key not in own:
                own[key] = labels
    return dict(found)


def cells_by_label(cells: Cells, labels: Labels) -> dict[str, Cells]:
    """Return for each label the cells with only the verdicts on its instructions.

    Labels that are numbers come by size, then words by letters, then unknown. Trials whose
    instruction no record describes are unknown, if it is not explicit. Errors and missing trials
    are not counted, and cells without a verdict are left out.
    """
    found: dict[str, dict[CellKey, dict[Trial, bool]]] = {}
    for key, cell in cells.items():
        usual = () if key.options.setting == EXPLICIT else (UNKNOWN,)
        for trial, won in cell.verdicts.items():
            for label in labels.get(InstructionKey.of_trial(key, trial), usual):
                found.setdefault(label, {}).setdefault(key, {})[trial] = won
    return {
        label: {key: CellResults(verdicts) for key, verdicts in found[label].items()}
        for label in sorted(found, key=lambda label: (label == UNKNOWN, _natural(label)))
    }


def _natural(text: str) -> list[tuple[int, int, str]]:
    parts = re.findall(r"\d+|\D+", text)
    return [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in parts]
