"""A comparison as sentences."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from roboirg.core.plain_text import counted, verb_for
from roboirg.evaluation.analysis.stats.comparison import Comparison, ComparisonResult
from roboirg.evaluation.analysis.stats.option_labels import options_label
from roboirg.evaluation.analysis.stats.power import MAX_EPISODES, POWER
from roboirg.evaluation.analysis.stats.rates import interval_note, p_text, points


def sentences(comparison: Comparison, first: str, second: str) -> Iterator[str]:
    """Yield the results, a sentence each; empty ones separate paragraphs.

    `first` and `second` are labels.
    """
    names = (first, second)
    yield f"{first} against {second}, on the same episodes."
    yield ""
    for result in comparison.averages:
        yield _sentence(result, names)
    decided = [result for result in comparison.cells if result.verdict != "open"]
    if any(len(result.tasks) > 1 for result in comparison.averages):
        yield ""
        cells = f"{counted(len(comparison.cells), 'single cell')} (one task in one setting)"
        yield (
            f"{len(decided)} of {cells} {'shows' if len(decided) == 1 else 'show'} a difference:"
            if decided
            else f"None of {cells} shows a difference by itself."
        )
        for result in sorted(decided, key=lambda result: -abs(result.gap.value)):
            yield f"  {_subject(result)}: {_better(result, names)}, {_figures(result)}."
    for title, results in comparison.parts.items():
        yield ""
        yield f"By {title}:" if results else f"By {title}: no instruction has one."
        for result in results:
            yield f"  {_sentence(result, names)}"
    yield ""
    yield from _caveats(comparison)


def _sentence(result: ComparisonResult, names: tuple[str, str]) -> str:
    if result.verdict == "open":
        return f"{_subject(result)}: no clear difference, {_figures(result)}.{_outlook(result)}"
    return f"{_subject(result)}: {_better(result, names)}, {_figures(result)}."


def _subject(result: ComparisonResult) -> str:
    task, options, part = result.key
    label = ", ".join((options_label(options), *([] if part is None else [part])))
    return label if task is None else f"{task}, {label}"


def _better(result: ComparisonResult, names: tuple[str, str]) -> str:
    return f"{names[result.verdict == 'second']} is better"


def _figures(result: ComparisonResult) -> str:
    gap = result.gap
    words = f"{points(gap.value, 1)} points{interval_note(gap.interval)}"
    tasks = "" if len(result.tasks) == 1 else f" of {len(result.tasks)} tasks"
    p_value = p_text(result.p_holm)
    if _is_surprising(result):
        p_value += f" (uncorrected {p_text(gap.p_value).removeprefix('p ').removeprefix('= ')})"
    return f"{words}, {p_value}, {counted(gap.episodes, 'episode')}{tasks}"


def _is_surprising(result: ComparisonResult) -> bool:
    """Return whether the interval excludes no difference, and the corrected test does not."""
    interval = result.gap.interval
    return (
        result.verdict == "open" and interval is not None and not interval.low <= 0 <= interval.high
    )


def _outlook(result: ComparisonResult) -> str:
    """Say which gaps these episodes show, and how many episodes would show this gap."""
    least = result.detectable
    words = " With so few episodes, no gap can be detected"
    if least is not None:
        words = f" These episodes can show gaps of {100 * least:.1f} points or more"
    words += f" with {POWER:.0%} power".replace("%", " %")
    if result.gap.value == 0:
        return f"{words}; the two did equally well."
    needed = result.needed
    number = f"more than {MAX_EPISODES:,}" if needed is None else f"about {needed:,}"
    return f"{words}; showing a gap of this size needs {number}."


def _caveats(comparison: Comparison) -> Iterator[str]:
    unpaired = sum(result.unpaired for result in comparison.averages)
    unjudged = sum(result.unjudged for result in comparison.averages)
    several = any(len(result.tasks) > 1 for result in comparison.averages)
    yield "p-values are from the exact paired test, after Holm's correction" + (
        ": over the averages, and over the single cells. An average is the unweighted mean over "
        "tasks."
        if several
        else " over the settings."
    )
    shown = (*comparison.averages, *itertools.chain.from_iterable(comparison.parts.values()))
    if any(map(_is_surprising, shown)):
        yield (
            "An interval belongs to one gap alone, so it may exclude 0 although p is above 0.05; "
            "p is corrected for all gaps that are tested together, and p decides."
        )
    if comparison.parts:
        yield "Each breakdown is corrected separately, over all its rows."
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
