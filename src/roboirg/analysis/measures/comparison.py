"""Comparison of two policies on the same episodes with the same instruction options."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from roboirg.analysis.measures.anytime_figures import AnytimeFigures, anytime_figures
from roboirg.analysis.measures.breakdowns import Breakdown, labeled, natural
from roboirg.analysis.measures.measure import Measured, measure_groups
from roboirg.analysis.results.frame import Frame
from roboirg.analysis.results.option_labels import (
    REFERENCE_OPTIONS,
    SortKey,
    options_sort_key,
)
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.records.mixing import FAIRNESS, differing
from roboirg.stats.cells import NOTHING, ByTask, Key, gather


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

    @property
    def is_average(self) -> bool:
        """Whether it is about all tasks and all instructions."""
        return self.task is None and self.part is None


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
        anytime: of each average, what holds however often one looked.
        parts: by the title of a breakdown, the averages over the instructions of each label.
    """

    first: PolicyRun
    second: PolicyRun
    averages: Sequence[Compared]
    cells: Sequence[Compared]
    anytime: Sequence[AnytimeFigures]
    parts: Mapping[str, Sequence[Compared]]

    @property
    def is_of_settings(self) -> bool:
        """Whether settings of one policy are compared with explicit."""
        return self.first is self.second

    @property
    def is_until_decided(self) -> bool:
        """Whether the run of a policy stopped when it was decided."""
        return self.first.is_until_decided or self.second.is_until_decided


def compare(first: Frame, second: Frame, breakdowns: Sequence[Breakdown] = ()) -> Comparison:
    """Compare two policies on the episodes that both played.

    Control arms, which play a scene with other words than its own, are left out.

    Args:
        first: the results of one policy.
        second: those of the other.
        breakdowns: by what the averages are broken down, too; their columns are in both frames.

    Raises:
        InvalidValueError: one side has several policies or versions, the two have different
            conditions, or they have no episode in common.
    """
    first = first.without_control_arms()
    second = second.without_control_arms()
    first_run = only_policy_run(first)
    second_run = only_policy_run(second)
    _check_fair(first, second)
    found = _measure(dict(_groups(first, breakdowns)), dict(_groups(second, breakdowns)))
    averages = [result for result in found if result.key.is_average]
    if not averages:
        raise InvalidValueError(
            f"{first_run.policy} and {second_run.policy} have no episode in common with the same "
            "instruction; play both on the same tasks, settings and episodes."
        )
    cells = [result for result in found if result.key.task is not None]
    parts = {}
    for breakdown in breakdowns:
        part = [result for result in found if result.key.part == breakdown.title]
        # Labels stay in their order within each set of options.
        part.sort(key=lambda result: options_sort_key(result.key.options))
        parts[breakdown.title] = part
    anytime = anytime_figures(averages, first_run, second_run)
    return Comparison(first_run, second_run, averages, cells, anytime, parts)


def compare_settings(frame: Frame) -> Comparison:
    """Compare every setting that a policy played with explicit, which names the goal.

    Both sides of the comparison are the same policy run.

    Raises:
        InvalidValueError: there are several policies or versions, or explicit or anything else was
            not played.
    """
    frame = frame.without_control_arms()
    policy_run = only_policy_run(frame)
    groups = dict(_groups(frame, ()))
    settings = {}
    explicit = {}
    for key, cells in groups.items():
        if key.options != REFERENCE_OPTIONS:
            settings[key] = cells
            explicit[key] = groups.get(key._replace(options=REFERENCE_OPTIONS), NOTHING)
    found = _measure(settings, explicit)
    averages = [result for result in found if result.key.is_average]
    if not averages:
        raise InvalidValueError(
            f"{policy_run.policy} has not played explicit and another setting in the same "
            "episodes; name a second run to compare it with another policy."
        )
    cells_alone = [result for result in found if result.key.task is not None]
    anytime = anytime_figures(averages, policy_run, policy_run)
    return Comparison(policy_run, policy_run, averages, cells_alone, anytime, {})


def _measure(
    first: Mapping[ComparisonKey, ByTask], second: Mapping[ComparisonKey, ByTask]
) -> list[Compared]:
    """Return by how much the success of two policies differs, in each group that both played.

    A group is a task or an average over tasks, in one setting; an average is over the tasks that
    both played. P-values are corrected among averages, among tasks, and in each breakdown.
    """
    shared_first = {}
    shared_second = {}
    for key in first:
        if key in second:
            shared_first[key] = _shared(first[key], second[key])
            shared_second[key] = _shared(second[key], first[key])
    measured = measure_groups(
        shared_first,
        lambda key: shared_second[key],
        family=lambda key: (key.part, key.task is None),
        with_intervals=False,
    )
    return [result for result in measured if result.gap is not None]


def _groups(
    frame: Frame, breakdowns: Sequence[Breakdown]
) -> Iterator[tuple[ComparisonKey, ByTask]]:
    """Yield the groups of one policy's results that are compared, each with its cells by task.

    They are each task, the average over tasks, and each label of a breakdown (a kind of
    instructions), all by instruction options. Explicit instructions are not broken down.
    """
    by_options = gather(frame, ("options",))
    # Groups by one column have keys of one value.
    for (options,) in sorted(by_options, key=lambda key: options_sort_key(*key)):
        by_task = by_options[options,]
        for task, cell in by_task.items():
            yield ComparisonKey(options, task), {task: cell}
        yield ComparisonKey(options), by_task

    for breakdown in breakdowns:
        by_label = gather(labeled(frame, breakdown), ("label", "options"))
        for label, options in sorted(by_label, key=_label_order):
            if options != REFERENCE_OPTIONS:
                key = ComparisonKey(options, None, breakdown.title, label)
                yield key, by_label[label, options]


def _label_order(key: Key) -> SortKey:
    """Return a key that sorts pairs of a label and options."""
    label, options = key
    return natural(label), options_sort_key(options)


def _shared(cells: ByTask, others: ByTask) -> ByTask:
    """Return the cells of the tasks that others have, too."""
    return {task: cell for task, cell in cells.items() if task in others}


def only_policy_run(frame: Frame) -> PolicyRun:
    """Return the policy run that all results are of: a policy, its conditions and versions.

    Raises:
        InvalidValueError: there are no results, or they are of several policies or policy runs.
    """
    policy_runs = list(frame.names)
    names = list(dict.fromkeys(policy_run.policy for policy_run in policy_runs))
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
    """Check that two policies can be compared fairly.

    Raises:
        InvalidValueError: one has no results, or they were played under different conditions.
    """
    for frame in (first, second):
        if not frame.is_played.any():
            raise InvalidValueError("One of the two policies has no results yet.")
    differences = list(differing([*first.played, *second.played], FAIRNESS))
    if differences:
        raise InvalidValueError(" ".join(differences))
