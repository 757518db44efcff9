"""Two policies on the same episodes, told in the same ways: which is better where."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from roboirg.analysis.stats.intervals import ALPHA
from roboirg.analysis.stats.multiple_testing import holm
from roboirg.analysis.stats.paired_tests import Gap, Pairs, measure_gap
from roboirg.analysis.stats.power import episodes_needed, smallest_gap
from roboirg.analysis.stats.samples import CellResults, PolicyRun, Samples
from roboirg.analysis.stats.success_rates import SettingColumn
from roboirg.core.errors import InvalidValueError

Verdict = Literal["first", "second", "open"]


class Where(NamedTuple):
    """A telling, of one task or (None) of all that both played."""

    task: str | None
    variant: SettingColumn


@dataclass(frozen=True, slots=True)
class ComparisonResult:
    """What can be said about one telling.

    Attributes:
        where: task and telling.
        tasks: that were paired.
        gap: of the first to the second.
        p_holm: its p-value after Holm's correction over all averages, or over all single tasks.
        unpaired: trials with a verdict of one of them that the other did not play.
        unjudged: trials of either that ended in an error or are still to be played.
    """

    where: Where
    tasks: tuple[str, ...]
    gap: Gap
    p_holm: float
    unpaired: int
    unjudged: int

    @property
    def verdict(self) -> Verdict:
        """Who is better; open where the corrected test does not tell."""
        if self.p_holm > ALPHA or self.gap.value == 0:
            return "open"
        return "first" if self.gap.value > 0 else "second"

    @property
    def discordance(self) -> float:
        """Share of the episodes on which the two differ, at least the gap."""
        return max(abs(self.gap.value), self.gap.overlap.discordance or 0.0)

    @property
    def detectable(self) -> float | None:
        """The smallest gap that these episodes would show in 4 of 5 cases; None for none."""
        return smallest_gap(self.gap.episodes, self.discordance)

    @property
    def needed(self) -> int | None:
        """How many episodes would show a gap as large as this in 4 of 5 cases; None for none."""
        return episodes_needed(self.gap.value, self.discordance)


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two policies, averages first.

    Attributes:
        first: who.
        second: against whom.
        averages: for each telling, the unweighted mean over the tasks that both played.
        cells: for each telling and task.
    """

    first: PolicyRun
    second: PolicyRun
    averages: tuple[ComparisonResult, ...]
    cells: tuple[ComparisonResult, ...]


def compare(first: Samples, second: Samples, rng: np.random.Generator) -> Comparison:
    """Compare two policies on the episodes that both played.

    Args:
        first: the samples of one policy, under one set of rules.
        second: of the other.
        rng: of the bootstrap.

    Raises:
        InvalidValueError: one of them is several policies or versions, the words or worlds of the
            two are of different versions, or they share no episode.
    """
    ours, theirs = _only(first), _only(second)
    _check_fair(ours, theirs)
    here = {(task, told): sample for (_, task, told), sample in first.items()}
    there = {(task, told): sample for (_, task, told), sample in second.items()}
    cells, averages = [], []
    for variant in sorted(
        {told for _, told in here.keys() & there.keys()}, key=SettingColumn.sort_key
    ):
        tasks = [task for task, told in here if told == variant and (task, told) in there]
        cells += [_finding(Where(task, variant), [task], here, there, rng) for task in tasks]
        averages.append(_finding(Where(None, variant), tasks, here, there, rng))
    found = _corrected(averages)
    if not found:
        raise InvalidValueError(
            f"{ours.policy} and {theirs.policy} have no episode in common that both were told in "
            "the same way; play both on the same tasks, settings and episodes."
        )
    return Comparison(ours, theirs, found, _corrected(cells))


def _finding(
    where: Where,
    tasks: Sequence[str],
    here: Mapping[tuple[str, SettingColumn], CellResults],
    there: Mapping[tuple[str, SettingColumn], CellResults],
    rng: np.random.Generator,
) -> ComparisonResult | None:
    both = [(here[task, where.variant], there[task, where.variant]) for task in tasks]
    pairs = [Pairs.of(ours, theirs) for ours, theirs in both]
    gap = measure_gap(pairs, rng)
    if gap is None:
        return None
    tried = sum(int(each.rows[:, 1::2].sum()) for each in pairs)
    return ComparisonResult(
        where=where,
        tasks=tuple(task for task, each in zip(tasks, pairs, strict=True) if len(each.rows)),
        gap=gap,
        p_holm=gap.p_value,
        unpaired=sum(ours.trials + theirs.trials for ours, theirs in both) - tried,
        unjudged=sum(one.errors + one.missing for pair in both for one in pair),
    )


def _corrected(findings: Sequence[ComparisonResult | None]) -> tuple[ComparisonResult, ...]:
    found = [finding for finding in findings if finding is not None]
    adjusted = holm([finding.gap.p_value for finding in found])
    return tuple(
        replace(finding, p_holm=p_value) for finding, p_value in zip(found, adjusted, strict=True)
    )


def _only(samples: Samples) -> PolicyRun:
    contestants = list(dict.fromkeys(who for who, _, _ in samples))
    names = list(dict.fromkeys(who.policy for who in contestants))
    if not names:
        raise InvalidValueError("There are no results to compare; play something first.")
    if len(names) > 1:
        raise InvalidValueError(
            f"The run has several policies ({', '.join(names)}); name one as RUN:{names[0]}."
        )
    if len(contestants) > 1:
        raise InvalidValueError(
            f"{names[0]} played under several rules or in several versions, which cannot be taken "
            "together; give runs with one of each."
        )
    return contestants[0]


def _check_fair(first: PolicyRun, second: PolicyRun) -> None:
    if first.versions is None or second.versions is None:
        raise InvalidValueError("One of the two has played nothing yet.")
    for name in ("language", "environment"):
        one, other = getattr(first.versions, name), getattr(second.versions, name)
        if one != other:
            raise InvalidValueError(
                f"{first.policy} played {name} version {one} and {second.policy} version {other}; "
                "only results of the same version can be compared."
            )
    for name in ("split", "max_steps", "meshes"):
        one, other = getattr(first.rules, name), getattr(second.rules, name)
        if one != other:
            raise InvalidValueError(
                f"{first.policy} played with {name} {one} and {second.policy} with {other}; "
                "only results under the same rules can be compared."
            )
