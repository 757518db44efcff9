"""Comparison of two policies on the same episodes with the same instruction options."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.results.frame import MISSING, Frame
from roboirg.evaluation.analysis.results.option_labels import options_sort_key, reference_of
from roboirg.evaluation.analysis.results.policy_run import PolicyRun
from roboirg.evaluation.analysis.stats.breakdowns import Breakdown, labeled, natural
from roboirg.evaluation.analysis.stats.cells import ByTask, gather
from roboirg.evaluation.analysis.stats.measure import Measured, measure_groups
from roboirg.evaluation.records.mixing import FAIRNESS, differing


class ComparisonKey(NamedTuple):
    """What is compared.

    Attributes:
        options: instruction options.
        task: one task or, as None, all tasks that both policies played.
        part: title of a breakdown; None for all instructions.
        label: of the instructions, in a breakdown.
    """

    options: InstructionOptions
    task: str | None = None
    part: str | None = None
    label: str = ""


Compared = Measured[ComparisonKey]
"""The first policy, its gap to the second, and p-values that are corrected over all averages, over
all single cells, or over all parts of a breakdown."""


class Comparison(NamedTuple):
    """The comparison of two policies.

    Attributes:
        first: one policy run.
        second: the other.
        averages: for each set of options, the unweighted mean over the tasks that both played.
        cells: for each task and set of options.
        parts: by the title of a breakdown, the averages over the instructions of each label.
    """

    first: PolicyRun
    second: PolicyRun
    averages: Sequence[Compared]
    cells: Sequence[Compared]
    parts: Mapping[str, Sequence[Compared]]


def compare(first: Frame, second: Frame, breakdowns: Sequence[Breakdown] = ()) -> Comparison:
    """Compare two policies on the episodes that both played, in the arm ``told`` if both have it.

    Args:
        first: the results of one policy.
        second: those of the other.
        breakdowns: by what the averages are broken down, too; their columns are in both frames.

    Raises:
        InvalidValueError: one side has several policies or versions, the two have different
            conditions, or they have no episode in common.
    """
    first = first.told()
    second = second.told()
    ours = _only_policy_run(first)
    theirs = _only_policy_run(second)
    _check_fair(first, second)
    here, there = (dict(_groups(one, breakdowns)) for one in (first, second))
    others = {key: _shared(there[key], here[key]) for key in here if key in there}
    found = measure_groups(
        {key: _shared(here[key], there[key]) for key in others},
        [others.__getitem__],
        lambda key: (key.part, key.task is None),
        with_intervals=False,
    )
    results = [one for one in found if one.gap is not None]
    averages = [one for one in results if one.key[1:3] == (None, None)]
    if not averages:
        raise InvalidValueError(
            f"{ours.policy} and {theirs.policy} have no episode in common with the same "
            "instruction; play both on the same tasks, settings and episodes."
        )
    parts = {
        breakdown.title: sorted(
            (one for one in results if one.key.part == breakdown.title),
            key=lambda one: options_sort_key(one.key.options),
        )
        for breakdown in breakdowns
    }
    cells = [one for one in results if one.key.task is not None]
    return Comparison(ours, theirs, averages, cells, parts)


def _groups(
    frame: Frame, breakdowns: Sequence[Breakdown]
) -> Iterator[tuple[ComparisonKey, ByTask]]:
    """Yield what is compared of one policy; explicit instructions are not broken down."""
    groups = gather(frame, ("options",))
    for (options,) in sorted(groups, key=lambda key: options_sort_key(key[0])):
        for task, cell in groups[options,].items():
            yield ComparisonKey(options, task), {task: cell}
        yield ComparisonKey(options), groups[options,]
    for breakdown in breakdowns:
        groups = gather(labeled(frame, breakdown), ("label", "options"))
        for label, options in sorted(
            groups, key=lambda key: (natural(key[0]), options_sort_key(key[1]))
        ):
            if options != reference_of(options):
                key = ComparisonKey(options, None, breakdown.title, label)
                yield key, groups[label, options]


def _shared(cells: ByTask, others: ByTask) -> ByTask:
    return {task: cell for task, cell in cells.items() if task in others}


def _only_policy_run(frame: Frame) -> PolicyRun:
    policy_runs = list(frame.names)
    names = list(dict.fromkeys(one.policy for one in policy_runs))
    if not names:
        raise InvalidValueError("There are no results to compare; play something first.")
    if len(names) > 1:
        raise InvalidValueError(
            f"The run has several policies ({', '.join(names)}); name one as RUN:{names[0]}."
        )
    if len(policy_runs) > 1:
        raise InvalidValueError(
            f"{names[0]} played under several conditions or in several versions, whose results "
            "cannot be pooled; give runs with one of each."
        )
    return policy_runs[0]


def _check_fair(first: Frame, second: Frame) -> None:
    if any({*one["outcome"]} <= {MISSING} for one in (first, second)):
        raise InvalidValueError("One of the two policies has no results yet.")
    differences = [*differing([*first.played, *second.played], FAIRNESS)]
    if differences:
        raise InvalidValueError(" ".join(differences))
