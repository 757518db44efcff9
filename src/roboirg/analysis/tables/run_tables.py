"""The table on the terminal: tasks × settings, one for each policy."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from roboirg.analysis.stats.success_rates import EXPLICIT, Cell, Panel, SettingColumn
from roboirg.records.record import Result

MINIMUM_WIDTH = 100
"""Columns to use where the output is not a terminal."""

ERROR_MARK = "!"
MISSING_MARK = "…"
ALL_TASKS = "all tasks"
NO_GAP = "–"

MOST_FAILURES = 10
"""Episodes of a policy that are named below the tables."""

_GOOD, _FAIR = 0.75, 0.4


def make_table(panel: Panel) -> Table:
    """Tasks × settings of one policy: success rate and, in brackets, the gap to explicit."""
    table = Table(
        title=panel.label,
        title_justify="left",
        title_style="bold",
        caption=_numbers(panel),
        caption_justify="left",
        caption_style="dim",
    )
    table.add_column("task")
    for variant in panel.variants:
        table.add_column(variant.label, justify="right")
    rows: list[tuple[str, str | None]] = [(task, task) for task in panel.tasks]
    if len(panel.tasks) > 1:
        rows.append((ALL_TASKS, None))
    for name, task in rows:
        if task is None:
            table.add_section()
        cells = [
            _text(panel.cells.get((task, variant)), is_reference=variant == EXPLICIT)
            for variant in panel.variants
        ]
        table.add_row(Text(name, "bold" if task is None else ""), *cells)
    return table


def print_tables(panels: Sequence[Panel], console: Console) -> None:
    """Print every policy's table and, below, what the signs mean."""
    if not console.is_terminal:
        console.width = max(console.width, MINIMUM_WIDTH)
    for panel in panels:
        console.print(make_table(panel))
    legend = "success rate in %"
    cells = [cell for panel in panels for cell in panel.cells.values()]
    if any(
        cell.gap is not None and cell.rate is not None and variant != EXPLICIT
        for panel in panels
        for (_, variant), cell in panel.cells.items()
    ):
        legend += ", in brackets the gap to explicit on the same episodes in points"
    if any(
        gap_text(cell) == NO_GAP and variant != EXPLICIT
        for panel in panels
        for (_, variant), cell in panel.cells.items()
    ):
        legend += f"; ({NO_GAP}) nothing succeeded in explicit either, which says nothing"
    if any(cell.errors for cell in cells):
        legend += f"; {ERROR_MARK} episodes ended in an error and are in no rate"
    if any(cell.missing for cell in cells):
        legend += f"; {MISSING_MARK} episodes are still to be played"
    if any(panel.privileged for panel in panels):
        legend += "; privileged policies look behind the scenes"
    console.print(legend, style="dim", highlight=False)


def print_failures(records: Iterable[Result], console: Console, most: int = MOST_FAILURES) -> None:
    """Name the episodes of each policy that did not succeed, and why; the rest are counted."""
    lost: dict[str, list[Result]] = {}
    for record in records:
        if record.outcome != "success":
            lost.setdefault(record.policy, []).append(record)
    for policy, failures in lost.items():
        title = f"{len(failures)} episode{'' if len(failures) == 1 else 's'} without success"
        console.print(Text.assemble((policy, "bold"), f": {title}"))
        # The same order, however many processes played.
        failures.sort(
            key=lambda one: (one.task, one.split, one.episode, SettingColumn.of(one).sort_key())
        )
        for record in failures[:most]:
            console.print(Text(f"  {failure_text(record)}"), highlight=False, soft_wrap=True)
        if len(failures) > most:
            console.print(f"  and {len(failures) - most} more", highlight=False)


def failure_text(record: Result) -> str:
    """Which episode it was, how it was told, and what went wrong."""
    mark = ERROR_MARK if record.outcome == "error" else ""
    where = f"{record.task} {record.split}/{record.episode} {SettingColumn.of(record).label}"
    seed = f" (policy seed {record.policy_seed})" if record.policy_seed else ""
    return f"{where}{seed}: {record.cause or record.outcome}{mark and f' {mark}'}"


def percent(rate: float) -> str:
    """A rate as a whole per cent."""
    return f"{100 * rate:.0f}"


def points(gap: float) -> str:
    """A gap in signed percentage points, with a proper minus."""
    value = round(100 * gap)
    return f"{value:+d}".replace("-", "−") if value else "±0"


def count_text(least: int, most: int) -> str:
    """A number of episodes, or the range of it."""
    return f"{most}" if least == most else f"{least}–{most}"


def gap_text(cell: Cell) -> str:
    """The gap to explicit; a dash where explicit itself is at the floor, empty without pairs."""
    if cell.gap is None:
        return ""
    return NO_GAP if cell.is_at_floor and not cell.gap else points(cell.gap)


def _numbers(panel: Panel) -> str:
    text = f"n = {count_text(*panel.trials(panel.tasks))} episodes per cell"
    if len(panel.tasks) > 1:
        text += f", {count_text(*panel.trials([None]))} for {ALL_TASKS}"
    return text


def _text(cell: Cell | None, *, is_reference: bool) -> Text:
    if cell is None:
        return Text("–", "dim")
    text = Text()
    if cell.rate is None:
        text.append("–", "dim")
    else:
        text.append(percent(cell.rate), _color(cell.rate))
        if cell.gap is not None and not is_reference:
            text.append(f" ({gap_text(cell)})", "dim" if cell.gap >= 0 else "red")
    if cell.errors:
        text.append(f" {cell.errors}{ERROR_MARK}", "bold yellow")
    if cell.missing:
        text.append(f" {cell.missing}{MISSING_MARK}", "yellow")
    return text


def _color(rate: float) -> str:
    return "green" if rate >= _GOOD else "yellow" if rate >= _FAIR else "red"
