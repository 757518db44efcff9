"""Table of gaps to explicit, broken down by kind of instruction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from roboirg.evaluation.analysis.stats.breakdown_rows import BreakdownRow, break_down
from roboirg.evaluation.analysis.stats.breakdowns import UNKNOWN, Breakdown, Labels
from roboirg.evaluation.analysis.stats.cells import (
    Cells,
    PolicyRun,
    labels,
    policy_order,
    sort_cells,
)
from roboirg.evaluation.analysis.stats.comparison_text import incomplete_note
from roboirg.evaluation.analysis.stats.option_labels import REFERENCE, options_label
from roboirg.evaluation.analysis.stats.paired_tests import Gap
from roboirg.evaluation.analysis.stats.rates import p_text, percent, points
from roboirg.evaluation.analysis.tables.table import (
    NOT_APPLICABLE,
    Column,
    Counts,
    Entry,
    Row,
    Table,
)

COLUMNS = tuple(map(Column, ("episodes", "success", "gap", "95 % interval", "p")))


def make_breakdown_table(
    breakdown: Breakdown,
    cells: Cells,
    found: Labels,
    names: Mapping[PolicyRun, str] | None = None,
) -> Table:
    ordered = sort_cells(cells, list(names or policy_order(cells, ())))
    rows = break_down(ordered, found)
    names = names or labels(ordered)
    return Table(
        key=f"by_{breakdown.name}",
        title=f"Gap to explicit by {breakdown.title}",
        heads=("policy and setting", breakdown.title),
        columns=COLUMNS,
        rows=tuple(
            Row(
                f"{names[row.policy_run]}, {options_label(row.results.options)}",
                row.label,
                _cells(row),
            )
            for row in rows
        ),
        notes=tuple(_notes(breakdown, cells, rows)),
    )


def interval_text(gap: Gap | None) -> str:
    """Return the ends of a gap's interval in points; a dash without one."""
    if gap is None or gap.interval is None:
        return NOT_APPLICABLE
    low, high = (points(end, 1) for end in gap.interval)
    return f"{low} to {high}"


def corrected_p_text(p_value: float | None) -> str:
    """Return a p-value without its letter; a dash without one."""
    if p_value is None:
        return NOT_APPLICABLE
    return p_text(p_value).removeprefix("p ").removeprefix("= ")


def _cells(row: BreakdownRow) -> tuple[Entry | str, ...]:
    results = row.results
    counts = Counts(results.successes, results.trials, results.episodes, interval=row.interval)
    return (
        str(results.episodes),
        Entry(percent=None if results.rate is None else percent(results.rate), counts=counts),
        NOT_APPLICABLE if row.gap is None else points(row.gap.value, 1),
        interval_text(row.gap),
        corrected_p_text(row.p_holm),
    )


def _notes(breakdown: Breakdown, cells: Cells, rows: tuple[BreakdownRow, ...]) -> Iterator[str]:
    yield (
        "Success in percent, the gap to explicit on the same episodes in points, its interval, and "
        "its p-value corrected over all rows of the policy. Rates are means over the tasks that "
        "have such instructions, so two rows may differ in their tasks, too. "
        f"{breakdown.note}"
    )
    if any(row.label == UNKNOWN for row in rows):
        yield "Unknown: the records are older than this field."
    if any(row.gap is None and row.results.options != REFERENCE for row in rows):
        yield f"{NOT_APPLICABLE} without explicit on the same episodes."
    left_out = sum(cell.errors + cell.missing for cell in cells.values())
    if left_out:
        yield incomplete_note(left_out)
