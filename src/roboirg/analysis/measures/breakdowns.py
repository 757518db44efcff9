"""What gaps are broken down by: kinds of instructions, and the results on each."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

from roboirg.analysis.measures.measure import Measured, measure_groups, only_what_holds
from roboirg.analysis.results.frame import Frame
from roboirg.analysis.results.option_labels import (
    REFERENCE_OPTIONS,
    SortKey,
    options_sort_key,
)
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.core.instruction_options import InstructionOptions
from roboirg.stats.cells import NOTHING, ByTask, gather


class Breakdown(NamedTuple):
    """One way to break results down.

    Attributes:
        name: of a column of the frame. An episode counts in each of its texts, and in none if the
            question does not apply to it.
        title: heading of the labels.
        note: what the labels mean, a sentence.
        in_explicit: whether explicit instructions are broken down, too.
    """

    name: str
    title: str
    note: str
    in_explicit: bool = False


BREAKDOWNS: Mapping[str, Breakdown] = {
    breakdown.name: breakdown
    for breakdown in (
        Breakdown("pattern", "reasoning pattern", "Each episode counts in its main pattern."),
        Breakdown(
            "expression",
            "referring expression",
            "An episode counts in each class of expression that its command has.",
        ),
        Breakdown(
            "slots",
            "hidden slots",
            "Hidden slots are the values of the goal that the command leaves to its context.",
        ),
        Breakdown(
            "rival",
            "rival",
            "With a rival: how the words single out one of two values.",
        ),
        Breakdown(
            "difficulty",
            "difficulty",
            "The difficulty is that of the scene: its number of things, swaps or repetitions.",
            in_explicit=True,
        ),
    )
}


class LabelKey(NamedTuple):
    """Policy run and options, and the label of the instructions."""

    run: PolicyRun
    options: InstructionOptions
    label: str


def labeled(frame: Frame, breakdown: Breakdown) -> Frame:
    """Return the episodes with a verdict, once for each kind of instruction that each belongs to.

    The kind is in the column ``label``. It is the value of the breakdown's column, such as a
    difficulty; of several values, such as the pronoun and the ordinal in a command, each is a
    label. Explicit instructions have none unless the breakdown is of them, too.
    """
    judged = frame.take([outcome in ("success", "failure") for outcome in frame["outcome"]])
    labels_of_rows = []
    for value, options in zip(judged[breakdown.name], judged["options"], strict=True):
        values = value if isinstance(value, tuple) else (value,)
        if options == REFERENCE_OPTIONS and not breakdown.in_explicit:
            values = ()
        labels_of_rows.append([str(label) for label in values if label is not None])
    return judged.spread("label", labels_of_rows)


def break_down(frame: Frame, breakdown: Breakdown) -> tuple[Measured[LabelKey], ...]:
    """Measure success by kinds of instructions, for example by difficulty, with gaps to explicit.

    There is a row for each policy run, set of options and label (the kind), in the order of the
    frame. Each is compared with explicit instructions, which name the goal, on the very same
    episodes. P-values are corrected over the policy run. Errors and missing trials do not count.
    """
    by_options = gather(frame, ("run", "options"))
    by_label = gather(labeled(frame, breakdown), LabelKey._fields)
    runs = list(frame.names)

    def sort_key(key: LabelKey) -> SortKey:
        return runs.index(key.run), options_sort_key(key.options), natural(key.label)

    # Of explicit instructions, whatever their labels, a gap takes only the episodes of its row.
    def explicit(key: LabelKey) -> ByTask:
        if key.options == REFERENCE_OPTIONS:
            return NOTHING
        return by_options.get((key.run, REFERENCE_OPTIONS), NOTHING)

    keys = sorted(map(LabelKey._make, by_label), key=sort_key)
    groups = {key: by_label[key] for key in keys}
    measured = measure_groups(groups, explicit, family=lambda key: key.run)
    return tuple(only_what_holds(row, row.key.run) for row in measured)


def natural(text: str) -> list[tuple[bool, int, str]]:
    """Return a key that sorts texts by the numbers in them: ``frame 2`` before ``frame 10``.

    Of each part of it: whether it is no number, the number, and the words. For ``frame 2`` these
    are ``[(True, 0, "frame "), (False, 2, "")]``.
    """
    parts = []
    for part in re.findall(r"\d+|\D+", text):  # digits, or what is between them
        if part.isdigit():
            parts.append((False, int(part), ""))
        else:
            parts.append((True, 0, part))
    return parts
