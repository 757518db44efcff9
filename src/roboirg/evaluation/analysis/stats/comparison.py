"""Comparison of two policies on the same episodes with the same instruction options."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.stats.breakdowns import Labels, cells_by_label
from roboirg.evaluation.analysis.stats.cells import (
    FAIRNESS,
    CellResults,
    Cells,
    PolicyRun,
    only_told,
)
from roboirg.evaluation.analysis.stats.intervals import ALPHA, SEED
from roboirg.evaluation.analysis.stats.option_labels import REFERENCE, options_sort_key
from roboirg.evaluation.analysis.stats.paired_tests import Gap, Pairs, measure_gap, with_holm
from roboirg.evaluation.analysis.stats.power import episodes_needed, smallest_gap

Verdict = Literal["first", "second", "open"]


class ComparisonKey(NamedTuple):
    """What is compared.

    Attributes:
        task: one task or, as None, all tasks that both policies played.
        options: instruction options.
        label: of the instructions, in a breakdown; None for all instructions.
    """

    task: str | None
    options: InstructionOptions
    label: str | None = None


@dataclass(frozen=True, slots=True)
class ComparisonResult:
    """The comparison for one task or all tasks with one set of options.

    Attributes:
        key: task and options.
        tasks: that were paired.
        gap: first less second.
        p_holm: its p-value after Holm's correction over all averages, over all single cells, or
            over all parts of a breakdown.
        unpaired: trials with a verdict of one policy that the other did not play.
        unjudged: trials of either policy that ended in an error or are still to be played.
    """

    key: ComparisonKey
    tasks: tuple[str, ...]
    gap: Gap
    p_holm: float
    unpaired: int
    unjudged: int

    @property
    def verdict(self) -> Verdict:
        """The better policy; open if the corrected test does not decide."""
        if self.p_holm > ALPHA or self.gap.value == 0:
            return "open"
        return "first" if self.gap.value > 0 else "second"

    @property
    def discordance(self) -> float:
        """Share of the episodes on which the two differ, at least the gap."""
        return max(abs(self.gap.value), self.gap.overlap.discordance or 0.0)

    @property
    def detectable(self) -> float | None:
        """The smallest gap that these episodes show with a power of 80 %; None if there is none."""
        return smallest_gap(self.gap.episodes, self.discordance)

    @property
    def needed(self) -> int | None:
        """Episodes that show a gap of this size with a power of 80 %; None if there are none."""
        return episodes_needed(self.gap.value, self.discordance)


@dataclass(frozen=True, slots=True)
class Comparison:
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
    averages: tuple[ComparisonResult, ...]
    cells: tuple[ComparisonResult, ...]
    parts: Mapping[str, tuple[ComparisonResult, ...]]


def compare(first: Cells, second: Cells, labels: Mapping[str, Labels] | None = None) -> Comparison:
    """Compare two policies on the episodes that both played, in the arm ``told`` if both have it.

    Args:
        first: the cells of one policy run.
        second: the cells of the other.
        labels: of the instructions, by the title of each wanted breakdown.

    Raises:
        InvalidValueError: one side has several policies or versions, the two have different
            language or environment versions, or they share no episode.
    """
    rng = np.random.default_rng(SEED)
    first, second = only_told(first), only_told(second)
    ours, theirs = _only_policy_run(first), _only_policy_run(second)
    _check_fair(ours, theirs)
    here = {ComparisonKey(task, options): cell for (_, task, options), cell in first.items()}
    there = {ComparisonKey(task, options): cell for (_, task, options), cell in second.items()}
    shared = [key for key in here if key in there]
    cells: list[ComparisonResult] = []
    averages: list[ComparisonResult] = []
    for options in sorted({key.options for key in shared}, key=options_sort_key):
        keys = [key for key in shared if key.options == options]
        cells += filter(None, [_compared(key, [key], here, there, rng) for key in keys])
        average = _compared(ComparisonKey(None, options), keys, here, there, rng)
        averages += filter(None, [average])
    if not averages:
        raise InvalidValueError(
            f"{ours.policy} and {theirs.policy} have no episode in common with the same "
            "instruction; play both on the same tasks, settings and episodes."
        )
    parts = {
        title: with_holm(_compared_parts(first, second, own, rng))
        for title, own in (labels or {}).items()
    }
    return Comparison(ours, theirs, with_holm(averages), with_holm(cells), parts)


def _compared_parts(
    first: Cells, second: Cells, labels: Labels, rng: np.random.Generator
) -> list[ComparisonResult]:
    """Compare the averages over the instructions of each label; explicit ones have none."""
    found: list[ComparisonResult] = []
    ours, theirs = (
        cells_by_label({key: one for key, one in cells.items() if key.options != REFERENCE}, labels)
        for cells in (first, second)
    )
    for label in (label for label in ours if label in theirs):
        here, there = (
            {ComparisonKey(key.task, key.options): cell for key, cell in side[label].items()}
            for side in (ours, theirs)
        )
        shared = [key for key in here if key in there]
        for options in sorted({key.options for key in shared}, key=options_sort_key):
            keys = [key for key in shared if key.options == options]
            part = _compared(ComparisonKey(None, options, label), keys, here, there, rng)
            found += filter(None, [part])
    return sorted(found, key=lambda one: options_sort_key(one.key.options))


def _compared(
    key: ComparisonKey,
    cells: Sequence[ComparisonKey],
    here: Mapping[ComparisonKey, CellResults],
    there: Mapping[ComparisonKey, CellResults],
    rng: np.random.Generator,
) -> ComparisonResult | None:
    both = [(here[cell], there[cell]) for cell in cells]
    pairs = [Pairs.of(ours, theirs) for ours, theirs in both]
    gap = measure_gap(pairs, rng)
    if gap is None:
        return None
    paired = sum(int(each.rows[:, 1::2].sum()) for each in pairs)
    return ComparisonResult(
        key=key,
        tasks=tuple(
            str(cell.task) for cell, each in zip(cells, pairs, strict=True) if len(each.rows)
        ),
        gap=gap,
        p_holm=gap.p_value,
        unpaired=sum(ours.trials + theirs.trials for ours, theirs in both) - paired,
        unjudged=sum(one.errors + one.missing for pair in both for one in pair),
    )


def _only_policy_run(cells: Cells) -> PolicyRun:
    policy_runs = list(dict.fromkeys(key.policy_run for key in cells))
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


def _check_fair(first: PolicyRun, second: PolicyRun) -> None:
    if first.versions is None or second.versions is None:
        raise InvalidValueError("One of the two policies has no results yet.")
    for name in ("language", "environment"):
        one, other = getattr(first.versions, name), getattr(second.versions, name)
        if one != other:
            raise InvalidValueError(
                f"{first.policy} played {name} version {one} and {second.policy} version {other}; "
                "only results of the same version can be compared."
            )
    for name in FAIRNESS:
        one, other = first.conditions.label(name), second.conditions.label(name)
        if one != other:
            raise InvalidValueError(
                f"{first.policy} played with {one} and {second.policy} with {other}; "
                "only results under the same conditions can be compared."
            )
