"""A comparison in words."""

from __future__ import annotations

from collections.abc import Iterator

from roboirg.analysis.stats.comparison import Comparison, ComparisonResult
from roboirg.analysis.stats.power import MOST_EPISODES, POWER

_SMALLEST_P = 0.001


def sentences(comparison: Comparison, first: str, second: str) -> Iterator[str]:
    """What was found, a sentence each; paragraphs are separated by empty ones.

    Args:
        comparison: of two policies.
        first: what to call the first.
        second: what to call the second.
    """
    names = (first, second)
    yield f"{first} against {second}, on the same episodes."
    yield ""
    for finding in comparison.averages:
        yield _sentence(finding, names)
    told = [finding for finding in comparison.cells if finding.verdict != "open"]
    if any(len(finding.tasks) > 1 for finding in comparison.averages):
        yield ""
        yield (
            f"Of {_count(len(comparison.cells), 'single cell')} (a task told in one way), "
            f"{len(told)} can be told apart:"
            if told
            else f"None of {_count(len(comparison.cells), 'single cell')} (a task told in one way) "
            "can be told apart by itself."
        )
        for finding in sorted(told, key=lambda finding: -abs(finding.gap.value)):
            yield f"  {_where(finding)}: {_better(finding, names)}, {_figures(finding)}."
    yield ""
    yield from _caveats(comparison)


def _sentence(finding: ComparisonResult, names: tuple[str, str]) -> str:
    if finding.verdict == "open":
        return f"{_where(finding)}: cannot tell, {_figures(finding)}.{_more(finding)}"
    return f"{_where(finding)}: {_better(finding, names)}, {_figures(finding)}."


def _where(finding: ComparisonResult) -> str:
    task, variant = finding.where
    if task is not None:
        return f"{task}, {variant.label}"
    return variant.label


def _better(finding: ComparisonResult, names: tuple[str, str]) -> str:
    return f"{names[finding.verdict == 'second']} is better"


def _figures(finding: ComparisonResult) -> str:
    gap = finding.gap
    words = f"{_points(gap.value)} points"
    if gap.interval is not None:
        words += f" (95 % interval {_points(gap.interval.low)} to {_points(gap.interval.high)})"
    tasks = "" if len(finding.tasks) == 1 else f" of {len(finding.tasks)} tasks"
    return f"{words}, {_p(finding.p_holm)}, {_count(gap.episodes, 'episode')}{tasks}"


def _more(finding: ComparisonResult) -> str:
    """What it would take to tell."""
    least = finding.detectable
    can = "no gap" if least is None else f"gaps from {100 * least:.1f} points on"
    words = f" So many episodes show {can} in {POWER:.0%} of cases".replace("%", " %")
    if finding.gap.value == 0:
        return f"{words}; the two did equally well."
    needed = finding.needed
    number = f"more than {MOST_EPISODES}" if needed is None else f"about {needed}"
    return f"{words}; to show one of this size, {number} would be needed."


def _caveats(comparison: Comparison) -> Iterator[str]:
    unpaired = sum(finding.unpaired for finding in comparison.averages)
    unjudged = sum(finding.unjudged for finding in comparison.averages)
    several = any(len(finding.tasks) > 1 for finding in comparison.averages)
    yield "p-values are of the exact paired test, after Holm's correction" + (
        ": over the averages, and over the single cells. An average is the unweighted mean over "
        "tasks."
        if several
        else " over the settings."
    )
    if unpaired:
        yield f"{_count(unpaired, 'trial')} of one without counterpart of the other are left out."
    if unjudged:
        yield (
            f"Incomplete: {_count(unjudged, 'trial')} ended in an error or are still to be played, "
            "and are left out."
        )


def _p(value: float) -> str:
    return f"p < {_SMALLEST_P}" if value < _SMALLEST_P else f"p = {value:.3f}"


def _points(gap: float) -> str:
    text = f"{100 * gap:+.1f}".replace("-", "−")
    return "±0.0" if text in {"+0.0", "−0.0"} else text


def _count(number: int, name: str) -> str:
    return f"{number} {name}{'' if number == 1 else 's'}"
