"""A comparison as sentences."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Self, cast

from roboirg.analysis.measures.comparison import Compared, Comparison
from roboirg.core.instruction_options import options_label
from roboirg.core.plain_text import counted, verb_for
from roboirg.language.settings import EXPLICIT
from roboirg.stats.anytime import mean_difference
from roboirg.stats.intervals import ALPHA
from roboirg.stats.paired_tests import Gap
from roboirg.stats.power import (
    MAX_EPISODES,
    POWER,
    episodes_needed,
    smallest_gap,
)
from roboirg.stats.rates import interval_note, p_text, points


def sentences(comparison: Comparison, first: str, second: str) -> Iterator[str]:
    """Yield the comparison of two policies in lines of text; empty lines separate paragraphs.

    First the averages over tasks, then the single cells (one task in one setting) that differ, then
    each breakdown by kinds of instructions; at the end what p-values mean and what was left out.

    Args:
        comparison: of two policies, as measured.
        first: label of the first policy.
        second: label of the second policy.
    """
    if comparison.is_until_decided:
        yield from _until_decided(comparison, first, second)
        return
    averages = [_Result.of(comparison, row, first, second) for row in comparison.averages]
    cells = [_Result.of(comparison, row, first, second) for row in comparison.cells]
    breakdowns = {}
    for title, part in comparison.parts.items():
        breakdowns[title] = [_Result(row, first, second) for row in part]
    has_several_tasks = any(average.gap.tasks > 1 for average in averages)

    if comparison.is_of_settings:
        yield f"{first}, every setting against explicit on the same episodes."
    else:
        yield f"{first} against {second}, on the same episodes."
    yield ""
    for average in averages:
        yield average.sentence
    if has_several_tasks:
        yield ""
        yield from _decided_cells(cells)
    for title, rows in breakdowns.items():
        yield ""
        yield f"By {title}:" if rows else f"By {title}: no instruction has one."
        for row in rows:
            yield f"  {row.sentence}"

    yield ""
    results = itertools.chain(averages, *breakdowns.values())
    yield from _p_value_notes(results, has_several_tasks=has_several_tasks)
    yield f"However often one looked: {'; '.join(_anytime_texts(comparison))}."
    if breakdowns:
        yield "Each breakdown is corrected separately, over all its rows."
    yield from _left_out(comparison.averages)


def _anytime_texts(comparison: Comparison) -> Iterator[str]:
    """Yield of each average what holds however often one looked: ``direct p = 0.021``."""
    for average, figures in zip(comparison.averages, comparison.anytime, strict=True):
        yield f"{options_label(average.key.options)} {figures.text}"


def _until_decided(comparison: Comparison, first: str, second: str) -> Iterator[str]:
    """Yield the comparison of policies of which one played until it was decided.

    The number of its episodes depends on their results, so only what holds at any time is printed.
    """
    if comparison.is_of_settings:
        yield f"{first}, every setting against explicit; its run stopped when decided."
    else:
        yield f"{first} against {second}, on the same episodes; at least one stopped when decided."
    yield ""
    for average, figures in zip(comparison.averages, comparison.anytime, strict=True):
        result = _Result.of(comparison, average, first, second)
        gap = points(mean_difference(figures.pairs), 1)
        finding = "no clear difference"
        if figures.p_holm <= ALPHA:
            better = result.first if figures.pairs.better == "first" else result.second
            finding = f"{better} is better"
        label = options_label(average.key.options)
        yield f"{label}: {finding}, {gap} points, {figures.text}."
    yield ""
    yield (
        "p-values and intervals hold however often one looked, after Holm's correction over these "
        "averages; p-values for a fixed number of episodes would not."
    )
    if comparison.parts:
        yield "Breakdowns are left out: theirs are for a fixed number of episodes."
    yield from _left_out(comparison.averages)


def _p_value_notes(results: Iterable[_Result], *, has_several_tasks: bool) -> Iterator[str]:
    """Yield what p-values are corrected for, and why one may seem to contradict its interval.

    Args:
        results: the averages and the rows of breakdowns.
        has_several_tasks: whether averages are over more than one task.
    """
    if has_several_tasks:
        yield (
            "p-values are from the exact paired test, after Holm's correction: over the averages, "
            "and over the single cells. An average is the unweighted mean over tasks."
        )
    else:
        yield "p-values are from the exact paired test, after Holm's correction over the settings."
    if any(result.is_surprising for result in results):
        yield (
            "An interval belongs to one gap alone, so it may exclude 0 although p is above 0.05; "
            "p is corrected for all gaps that are tested together, and p decides."
        )


def _decided_cells(cells: Sequence[_Result]) -> Iterator[str]:
    """Yield how many single cells differ significantly, and a line for each, largest gap first.

    A single cell is the comparison of two policies in one task and one setting.
    """
    decided = [cell for cell in cells if cell.is_decided]
    total = f"{counted(len(cells), 'single cell')} (one task in one setting)"
    if not decided:
        yield f"None of {total} shows a difference by itself."
        return
    verb = "shows" if len(decided) == 1 else "show"
    yield f"{len(decided)} of {total} {verb} a difference:"
    for cell in sorted(decided, key=lambda cell: -abs(cell.gap.value)):
        yield f"  {cell.sentence}"


@dataclass(frozen=True)
class _Result:
    """One result in words.

    Attributes:
        result: that has a gap.
        first: label of the first policy.
        second: label of the second policy.
    """

    result: Compared
    first: str
    second: str

    @classmethod
    def of(cls, comparison: Comparison, result: Compared, first: str, second: str) -> Self:
        """Return a result of a comparison; a setting that is compared with explicit is a side."""
        if comparison.is_of_settings:
            return cls(result, options_label(result.key.options), EXPLICIT)
        return cls(result, first, second)

    @property
    def better(self) -> str:
        """The side with the higher rate."""
        return self.first if self.gap.value > 0 else self.second

    @property
    def gap(self) -> Gap:
        return cast("Gap", self.result.gap)  # results without one are left out

    @property
    def p_holm(self) -> float:
        return cast("float", self.result.p_holm)

    @property
    def is_decided(self) -> bool:
        """Whether the corrected test finds one better."""
        return self.p_holm <= ALPHA and self.gap.value != 0

    @property
    def is_surprising(self) -> bool:
        """Whether the interval excludes no difference, and the corrected test does not."""
        ends = self.gap.interval
        return not self.is_decided and ends is not None and not ends.low <= 0 <= ends.high

    @property
    def sentence(self) -> str:
        """Which of the two policies is better, and by how much, or that it is not clear.

        For example ``PickXtimes, relational: pi0 is better, +8.0 points (95 % interval …), …``.
        """
        key = self.result.key
        subject = options_label(key.options)
        if key.task is not None:
            subject = f"{key.task}, {subject}"
        if key.label:
            subject += f", {key.label}"
        if not self.is_decided:
            return f"{subject}: no clear difference, {self._figures}.{self._outlook}"
        return f"{subject}: {self.better} is better, {self._figures}."

    @property
    def _figures(self) -> str:
        """The gap with its interval, the p-value, and the number of episodes.

        For example ``+8.0 points (95 % interval +1.2 to +14.6), p = 0.021, 150 episodes of 3
        tasks``. If correcting the p-value for several tests made the gap insignificant, the
        uncorrected one follows.
        """
        gap = self.gap
        p_value = p_text(self.p_holm)
        uncorrected = p_text(gap.p_value)
        if self.is_surprising and uncorrected != p_value:
            p_value += f" (uncorrected {uncorrected.removeprefix('p ').removeprefix('= ')})"
        episodes = counted(gap.episodes, "episode")
        if gap.tasks > 1:
            episodes += f" of {gap.tasks} tasks"
        return f"{points(gap.value, 1)} points{interval_note(gap.interval)}, {p_value}, {episodes}"

    @property
    def _outlook(self) -> str:
        """How large a gap these episodes can show, and how many episodes this gap would need.

        For example ``These episodes can show gaps of 9.5 points or more with 80 % power; showing a
        gap of this size needs about 1,200.``
        """
        gap = self.gap
        # Share of the episodes on which the two differ, at least the gap.
        discordance = max(abs(gap.value), gap.overlap.discordance or 0.0)
        detectable_gap = smallest_gap(gap.episodes, discordance)
        words = " With so few episodes, no gap can be detected"
        if detectable_gap is not None:
            words = f" These episodes can show gaps of {100 * detectable_gap:.1f} points or more"
        words += f" with {100 * POWER:.0f} % power"
        if gap.value == 0:
            return f"{words}; the two did equally well."
        episodes = episodes_needed(gap.value, discordance)
        number = f"more than {MAX_EPISODES:,}"
        if episodes is not None:
            number = f"about {episodes:,}"
        return f"{words}; showing a gap of this size needs {number}."


def _left_out(averages: Iterable[Compared]) -> Iterator[str]:
    """Yield a sentence for trials that the averages leave out, if there are any.

    These have no counterpart of the other policy, or no verdict.
    """
    unpaired = 0
    unjudged = 0
    spared = 0
    for average in averages:
        for cell in (*average.cells.values(), *average.others.values()):
            unpaired += len(cell.verdicts)
            unjudged += cell.errors + cell.missing
            spared += cell.spared
        if average.gap is not None:
            unpaired -= average.gap.trials  # paired trials, counted for both policies
    if unpaired:
        verb = verb_for(unpaired, "are")
        yield f"{counted(unpaired, 'trial')} without a counterpart {verb} left out."
    yield from incomplete_notes(unjudged, spared)


def incomplete_notes(unjudged: int, spared: int) -> Iterator[str]:
    """Yield a sentence for trials without a verdict, if there are any.

    Args:
        unjudged: trials that ended in an error or are still to be played.
        spared: trials that need not be played.
    """
    if unjudged:
        yield (
            f"Incomplete: {counted(unjudged, 'trial')} without a verdict (an error, or still to be "
            f"played) {verb_for(unjudged, 'are')} left out."
        )
    if spared:
        yield f"{counted(spared, 'trial')} need not be played: what is compared was decided before."
