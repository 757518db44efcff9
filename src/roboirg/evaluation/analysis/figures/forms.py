"""Figure: overlap of the implicit and the resolved form, by suite and setting."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from roboirg.evaluation.analysis.figures.bars import Bar, Part, draw_bars
from roboirg.evaluation.analysis.stats.measure import ScopeKey
from roboirg.evaluation.analysis.stats.paired_tests import Gap
from roboirg.evaluation.analysis.stats.rates import points
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.diagnostic_tables import form_rows
from roboirg.evaluation.analysis.tables.table_notes import where_played

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from matplotlib.figure import Figure

PARTS = (
    Part("solved in both forms", "#56B4E9"),
    Part("only resolved", "#D55E00", "////"),
    Part("only implicit", "#009E73", "...."),
    Part("neither", "#dddddd"),
)
"""Outcomes of an episode in the two forms."""
NOTE = (
    "At the right: implicit − resolved in points, with its 95 % interval. n: trials in both forms."
)


def draw_forms(content: RunData) -> Figure | None:
    """Draw overlap and difference of the two forms; return None unless both were played."""
    rows = {
        run: list(_bars(own))
        for run, own in groupby(form_rows(content), lambda row: row[0].policy_run)
    }
    if not rows:
        return None
    notes = [NOTE, where_played([one.conditions for one in rows])]
    return draw_bars({content.name(one): bars for one, bars in rows.items()}, PARTS, notes)


def _bars(rows: Iterable[tuple[ScopeKey, Gap]]) -> Iterator[Bar]:
    """Yield the bars of a policy below the headings of their suites."""
    for scope, own in groupby(rows, lambda row: row[0].scope):
        yield Bar(scope, {}, 0, "")
        for key, gap in own:
            overlap = gap.overlap
            counts = (overlap.both, overlap.only_second, overlap.only_first, overlap.neither)
            text = points(gap.value)
            if gap.interval is not None:
                text += f" [{points(gap.interval.low)}, {points(gap.interval.high)}]"
            yield Bar(
                f"{key.options.setting}, n = {overlap.trials}",
                dict(zip((part.label for part in PARTS), counts, strict=True)),
                overlap.trials,
                text,
            )
