"""A comparison as sentences."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import cast

from roboirg.core.plain_text import counted, verb_for
from roboirg.evaluation.analysis.results.option_labels import options_label
from roboirg.evaluation.analysis.stats.comparison import Compared, Comparison
from roboirg.evaluation.analysis.stats.intervals import ALPHA
from roboirg.evaluation.analysis.stats.paired_tests import Gap
from roboirg.evaluation.analysis.stats.power import (
    MAX_EPISODES,
    POWER,
    episodes_needed,
    smallest_gap,
)
from roboirg.evaluation.analysis.stats.rates import interval_note, p_text, points


def sentences(comparison: Comparison, first: str, second: str) -> Iterator[str]:
    """Yield the results, a sentence each; empty ones separate paragraphs.

    `first` and `second` are labels.
    """
    names = (first, second)
    yield f"{first} against {second}, on the same episodes."
    yield ""
    averages = [_Result(one, names) for one in comparison.averages]
    yield from (one.sentence for one in averages)
    decided = [one for one in (_Result(one, names) for one in comparison.cells) if one.is_decided]
    several = any(one.gap.tasks > 1 for one in averages)
    if several:
        yield ""
        cells = f"{counted(len(comparison.cells), 'single cell')} (one task in one setting)"
        yield (
            f"{len(decided)} of {cells} {'shows' if len(decided) == 1 else 'show'} a difference:"
            if decided
            else f"None of {cells} shows a difference by itself."
        )
        for one in sorted(decided, key=lambda one: -abs(one.gap.value)):
            yield f"  {one.sentence}"
    parts = {title: [_Result(one, names) for one in own] for title, own in comparison.parts.items()}
    for title, own in parts.items():
        yield ""
        yield f"By {title}:" if own else f"By {title}: no instruction has one."
        yield from (f"  {one.sentence}" for one in own)
    yield ""
    yield "p-values are from the exact paired test, after Holm's correction" + (
        ": over the averages, and over the single cells. An average is the unweighted mean over "
        "tasks."
        if several
        else " over the settings."
    )
    if any(one.is_surprising for one in itertools.chain(averages, *parts.values())):
        yield (
            "An interval belongs to one gap alone, so it may exclude 0 although p is above 0.05; "
            "p is corrected for all gaps that are tested together, and p decides."
        )
    if parts:
        yield "Each breakdown is corrected separately, over all its rows."
    yield from _left_out(comparison.averages)


@dataclass(frozen=True)
class _Result:
    """One result in words, and the names of the two policies."""

    result: Compared
    names: tuple[str, str]

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
        options, task, _, label = self.result.key
        subject = ", ".join(filter(None, (task, options_label(options), label)))
        if self.is_decided:
            return f"{subject}: {self.names[self.gap.value < 0]} is better, {self._figures}."
        return f"{subject}: no clear difference, {self._figures}.{self._outlook}"

    @property
    def _figures(self) -> str:
        gap = self.gap
        words = f"{points(gap.value, 1)} points{interval_note(gap.interval)}"
        tasks = "" if gap.tasks == 1 else f" of {gap.tasks} tasks"
        p_value = p_text(self.p_holm)
        uncorrected = p_text(gap.p_value)
        if self.is_surprising and uncorrected != p_value:
            p_value += f" (uncorrected {uncorrected.removeprefix('p ').removeprefix('= ')})"
        return f"{words}, {p_value}, {counted(gap.episodes, 'episode')}{tasks}"

    @property
    def _outlook(self) -> str:
        """Which gaps these episodes show, and how many episodes would show this gap."""
        gap = self.gap
        # Share of the episodes on which the two differ, at least the gap.
        discordance = max(abs(gap.value), gap.overlap.discordance or 0.0)
        least = smallest_gap(gap.episodes, discordance)
        words = " With so few episodes, no gap can be detected"
        if least is not None:
            words = f" These episodes can show gaps of {100 * least:.1f} points or more"
        words += f" with {POWER:.0%} power".replace("%", " %")
        if gap.value == 0:
            return f"{words}; the two did equally well."
        needed = episodes_needed(gap.value, discordance)
        number = f"more than {MAX_EPISODES:,}" if needed is None else f"about {needed:,}"
        return f"{words}; showing a gap of this size needs {number}."


def _left_out(averages: Iterable[Compared]) -> Iterator[str]:
    """Yield how many trials are in no result."""
    unpaired = unjudged = 0
    for one in averages:
        cells = [*one.cells.values(), *one.others.values()]
        unpaired += sum(len(cell.verdicts) for cell in cells) - (one.gap.trials if one.gap else 0)
        unjudged += sum(cell.errors + cell.missing for cell in cells)
    if unpaired:
        verb = verb_for(unpaired, "are")
        yield f"{counted(unpaired, 'trial')} without a counterpart {verb} left out."
    if unjudged:
        yield incomplete_note(unjudged)


def incomplete_note(trials: int) -> str:
    """Return a sentence on trials that are left out, as they have no verdict."""
    return (
        f"Incomplete: {counted(trials, 'trial')} without a verdict (an error, or still to be "
        f"played) {verb_for(trials, 'are')} left out."
    )
