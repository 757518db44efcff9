"""What gaps are broken down by: kinds of instructions, and the results on each."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.results.frame import Frame
from roboirg.evaluation.analysis.results.option_labels import options_sort_key, reference_of
from roboirg.evaluation.analysis.results.policy_run import PolicyRun
from roboirg.evaluation.analysis.stats.cells import NOTHING, ByTask, gather
from roboirg.evaluation.analysis.stats.measure import Measured, measure_groups


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
    one.name: one
    for one in (
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
            "recency rival",
            "Commands that say “it”: with a recency rival, the last remark before the command is "
            "about another thing. With a rival: how the words single out one of two values.",
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
    """Return the episodes with a verdict, each once for each of its labels (column ``label``)."""
    frame = frame.take([one in ("success", "failure") for one in frame["outcome"]])
    found = []
    for value, options in zip(frame[breakdown.name], frame["options"], strict=True):
        own = value if isinstance(value, tuple) else (value,)
        is_asked = breakdown.in_explicit or options != reference_of(options)
        found.append([str(one) for one in own if is_asked and one is not None])
    return frame.spread("label", found)


def break_down(frame: Frame, breakdown: Breakdown) -> tuple[Measured[LabelKey], ...]:
    """Return a row for each policy run, set of options and label, in the order of the frame.

    Gaps are paired by episode: those of a label are compared with explicit on the very same
    episodes, whose instruction has the same label or none. P-values are corrected over the policy
    run. Errors and missing trials are not counted.
    """
    explicit = gather(frame, ("run", "options"))
    found = gather(labeled(frame, breakdown), LabelKey._fields)
    runs = list(frame.names)
    groups = {
        LabelKey(*key): found[key]
        for key in sorted(
            found, key=lambda key: (runs.index(key[0]), options_sort_key(key[1]), natural(key[2]))
        )
    }

    def reference(key: LabelKey) -> ByTask:
        options = reference_of(key.options)
        if key.options == options:
            return NOTHING
        if breakdown.in_explicit:
            return groups.get(key._replace(options=options), NOTHING)
        return explicit.get((key.run, options), NOTHING)

    return measure_groups(groups, [reference], lambda key: key.run)


def natural(text: str) -> list[tuple[int, int, str]]:
    """Sort numbers by size, and words by letters."""
    parts = re.findall(r"\d+|\D+", text)
    return [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in parts]
