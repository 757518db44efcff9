"""Figure: causes of failures, by policy and setting."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.figures.bars import Bar, Part, draw_bars
from roboirg.evaluation.analysis.results.option_labels import options_label, options_sort_key
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.diagnostic_tables import FAILURES, count_failures
from roboirg.evaluation.analysis.tables.table_notes import where_played

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ORANGE = ("#7f2704", "#a63603", "#c0510a", "#ee8130", "#fbb477", "#fddfbf", "#fff1e3")
_BLUE = ("#08306b", "#20578f", "#3f85bd", "#74b0d8", "#a9d0e8", "#d9ebf6")
_DARK = frozenset((*_ORANGE[:3], *_BLUE[:3]))
NOTE = "n: trials with a verdict; the rest of a bar succeeded."


PARTS = {
    failure: Part(
        f"{kind}: " * bool(kind) + failure.replace("_", " "),
        color,
        ink="white" if color in _DARK else "black",
    )
    for (failure, kind), color in zip(FAILURES.items(), (*_ORANGE, *_BLUE, "#bbbbbb"), strict=True)
}
"""By name of the failure: shades of orange for grounding, of blue for execution."""


def draw_failures(content: RunData) -> Figure | None:
    """Draw the shares of episodes by cause of failure; return None without failures."""
    counts = count_failures(content.frame, ("run", "options"))
    if not any(own[name] for own in counts.values() for name in PARTS):
        return None
    columns = sorted({options for _, options in counts}, key=options_sort_key)
    names = [one for one in content.frame.names if any(run == one for run, _ in counts)]
    rows = {
        content.name(one): [_bar(options, counts.get((one, options), {})) for options in columns]
        for one in names
    }
    notes = [NOTE, where_played([one.conditions for one in names])]
    return draw_bars(rows, list(PARTS.values()), notes)


def _bar(options: InstructionOptions, counts: Mapping[str, int]) -> Bar:
    parts = {part.label: counts.get(name, 0) for name, part in PARTS.items()}
    n = counts.get("trials", 0)
    return Bar(options_label(options), parts, n, f"n = {n}" if n else "–")
