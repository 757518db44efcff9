"""The terminal's table of a run: tasks × settings, one for each policy run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text

from roboirg.core.arms import TOLD
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted, printable
from roboirg.evaluation.analysis.comparability import (
    AllDifferences,
    comparison_notes,
    comparison_sign,
    differences_of,
)
from roboirg.evaluation.analysis.stats.cells import (
    Cells,
    PolicyRun,
    gather,
    labels,
    policy_order,
    sort_cells,
)
from roboirg.evaluation.analysis.stats.headline import headline_notes
from roboirg.evaluation.analysis.stats.heard_rates import count_heard, heard_notes
from roboirg.evaluation.analysis.stats.option_labels import (
    REFERENCE,
    options_label,
    options_sort_key,
)
from roboirg.evaluation.analysis.stats.paired_tests import Overlap
from roboirg.evaluation.analysis.stats.rates import points, whole_percent
from roboirg.evaluation.analysis.stats.run_summary import (
    ALL,
    ALL_TASKS,
    Scope,
    ScopeKey,
    ScopeResults,
    group_by_scope,
)
from roboirg.evaluation.analysis.tables.rendering.column_parts import BORDERS, split_columns
from roboirg.evaluation.analysis.tables.table import ERROR_MARK, MISSING_MARK
from roboirg.evaluation.analysis.tables.table_notes import where_played
from roboirg.evaluation.records.record import Job, Summary
from roboirg.util.console_width import line_width, widen

NO_GAP = "–"

MAX_FAILURES = 10
"""Episodes of a policy that are listed below the tables."""

_GOOD, _FAIR = 0.75, 0.4


@dataclass(frozen=True, slots=True)
class RunTable:
    """The results of one policy run.

    Attributes:
        policy_run: whose results they are.
        label: policy, whether it is privileged, and the conditions if there are several.
        tasks: the rows.
        columns: the instruction options.
        cells: results by scope (a task or `ALL`) and options.
        differences: of the explicit cells from the published rates.
        notes: sentences about prompts that were cut, or may have been, and its headline number.
    """

    policy_run: PolicyRun
    label: str
    tasks: tuple[str, ...]
    columns: tuple[InstructionOptions, ...]
    cells: dict[tuple[Scope, InstructionOptions], ScopeResults]
    differences: AllDifferences
    notes: tuple[str, ...] = ()


def make_run_tables(records: Sequence[Summary], planned: Sequence[Job] = ()) -> list[RunTable]:
    """Make a table for each policy run, in the order of the plan.

    Planned jobs without a record are counted as missing.
    """
    found = gather([("", records)], planned)
    policies = list(dict.fromkeys(job.policy for job in (*planned, *records)))
    cells = sort_cells(found, policy_order(found, policies))
    results = {one.key: one for one in group_by_scope(cells)}
    heard = count_heard((PolicyRun.of(one), one) for one in records)
    return [
        _make_run_table(
            policy_run,
            label,
            results,
            _explicit_differences(policy_run, cells),
            notes=(
                *heard_notes(heard, {policy_run: label}),
                *headline_notes(cells, {policy_run: label}),
            ),
        )
        for policy_run, label in labels(cells).items()
    ]


def print_run_tables(tables: Sequence[RunTable], console: Console) -> None:
    """Print every table and, below, what the signs mean."""
    for table in tables:
        grids = _grids(table, line_width(console))
        widen(console, *grids)
        for grid in grids:
            console.print(grid)
        # Not the grid's caption, which would be as narrow as the grid.
        console.print(Text(_caption(table)), style="dim", highlight=False)
    console.print("; ".join(_legend(tables)), style="dim", highlight=False)


def print_failures(
    records: Iterable[Summary], tables: Sequence[RunTable], console: Console
) -> None:
    """List for each table the episodes without success and the cause; count the rest."""
    failed: dict[PolicyRun, list[Summary]] = {}
    for record in records:
        if record.outcome != "success":
            failed.setdefault(PolicyRun.of(record), []).append(record)
    for table in tables:
        # The same order for any number of worker processes.
        failures = sorted(
            failed.get(table.policy_run, ()),
            key=lambda one: (one.task, one.split, one.episode, options_sort_key(one.options)),
        )
        if failures:
            title = f"{counted(len(failures), 'episode')} without success"
            console.print(Text.assemble((table.label, "bold"), f": {title}"), soft_wrap=True)
        for record in failures[:MAX_FAILURES]:
            console.print(Text(f"  {failure_text(record)}"), highlight=False, soft_wrap=True)
        if len(failures) > MAX_FAILURES:
            console.print(f"  and {len(failures) - MAX_FAILURES} more", highlight=False)


def failure_text(record: Summary) -> str:
    """Return the episode, its instruction options and the cause of its failure."""
    mark = f" {ERROR_MARK}" if record.outcome == "error" else ""
    where = f"{record.task} {record.split}/{record.episode} {options_label(record.options)}"
    seed = f" (policy seed {record.policy_seed})" if record.policy_seed else ""
    arm = "" if record.arm == TOLD else f" ({record.arm})"
    return f"{where}{seed}{arm}: {printable(record.cause or record.outcome)}{mark}"


def gap_text(overlap: Overlap) -> str:
    """Return the gap over paired trials.

    A dash if neither has a success, which says nothing; empty without pairs.
    """
    if not overlap.trials:
        return ""
    if not overlap.both and not overlap.only_first and not overlap.only_second:
        return NO_GAP
    return points((overlap.only_first - overlap.only_second) / overlap.trials)


def _make_run_table(
    policy_run: PolicyRun,
    label: str,
    results: dict[ScopeKey, ScopeResults],
    differences: AllDifferences,
    *,
    notes: tuple[str, ...],
) -> RunTable:
    cells = {
        (key.scope, key.options): one
        for key, one in results.items()
        if key.policy_run == policy_run and key.scope.suite is None
    }
    tasks = dict.fromkeys(scope.task for scope, _ in cells if scope.task is not None)
    columns = {options for _, options in cells}
    return RunTable(
        policy_run,
        label,
        tuple(tasks),
        tuple(sorted(columns, key=options_sort_key)),
        cells,
        differences,
        notes,
    )


def _explicit_differences(policy_run: PolicyRun, cells: Cells) -> AllDifferences:
    """Return the differences from the published rates; no other settings can be compared."""
    return {
        key: differences_of(key, cell)
        for key, cell in cells.items()
        if key.policy_run == policy_run and key.options == REFERENCE
    }


def _grids(table: RunTable, width: int) -> list[Grid]:
    """Draw tasks × settings: the success rate and, in brackets, the gap to explicit.

    A table that is wider than a line is drawn in parts; in each the task comes first.
    """
    signs = _explicit_signs(table)
    common = next(iter(signs.values())) if len(set(signs.values())) == 1 else ""
    rows = [(task, Scope(task=task)) for task in table.tasks]
    if len(table.tasks) > 1:
        rows.append((ALL_TASKS, ALL))
    columns = []
    for options in table.columns:
        head = f"{options_label(options)} {common if options == REFERENCE else ''}".rstrip()
        cells = [_text(table.cells.get((scope, options))) for _, scope in rows]
        if options == REFERENCE and not common:
            for (name, _), cell in zip(rows, cells, strict=True):
                cell.append(f" {signs[name]}" if name in signs else "", "dim")
        columns.append((head, cells))
    widths = [max(len(head), *(len(cell) for cell in cells)) + BORDERS for head, cells in columns]
    names = max(len(name) for name, _ in rows) + BORDERS + 1
    settings = [options.setting for options in table.columns]
    parts = split_columns(settings, widths, width - names)
    return [
        _grid(rows, [columns[index] for index in part], "" if number else table.label)
        for number, part in enumerate(parts)
    ]


def _grid(
    rows: Sequence[tuple[str, Scope]], columns: Sequence[tuple[str, list[Text]]], title: str
) -> Grid:
    grid = Grid(title=Text(title) if title else None, title_justify="left", title_style="bold")
    grid.add_column("task")
    for head, _ in columns:
        grid.add_column(head, justify="right")
    for place, (name, scope) in enumerate(rows):
        if scope == ALL:
            grid.add_section()
        style = "bold" if scope == ALL else ""
        grid.add_row(Text(name, style), *(cells[place] for _, cells in columns))
    return grid


def _legend(tables: Sequence[RunTable]) -> list[str]:
    """Explain the signs that occur."""
    cells = [cell for table in tables for cell in table.cells.values()]
    gaps = [gap_text(cell.explicit_overlap()) for cell in cells]
    legend = ["success rate in %"]
    if any(gaps):
        legend[0] += ", in brackets the gap to explicit on the same episodes in points"
    if NO_GAP in gaps:
        legend.append(f"({NO_GAP}) explicit has no success either, so the gap says nothing")
    if any(cell.errors for cell in cells):
        legend.append(f"{ERROR_MARK} episodes ended in an error and are left out of the rates")
    if any(cell.missing for cell in cells):
        legend.append(f"{MISSING_MARK} episodes are still to be played")
    if any(table.policy_run.is_privileged for table in tables):
        legend.append("privileged policies and scripted hands use the simulator's state")
    return legend


def _caption(table: RunTable) -> str:
    first = f"{where_played([table.policy_run.conditions])} {_sizes(table)}"
    notes = comparison_notes(table.differences, {table.policy_run: table.label})
    return "\n".join([first, *notes, *table.notes])


def _explicit_signs(table: RunTable) -> dict[str, str]:
    """Return for each task whether its explicit rate can be compared with the published one."""
    signs = {key.task: comparison_sign(one) for key, one in table.differences.items()}
    return {task: sign for task, sign in signs.items() if sign}


def _sizes(table: RunTable) -> str:
    single = [cell.trials for (scope, _), cell in table.cells.items() if scope != ALL]
    text = f"n = {_range(single)} {'episode' if max(single) == 1 else 'episodes'} per cell"
    if len(table.tasks) > 1:
        everything = [cell.trials for (scope, _), cell in table.cells.items() if scope == ALL]
        text += f", {_range(everything)} for {ALL_TASKS}"
    return text


def _range(counts: Sequence[int]) -> str:
    low, high = min(counts), max(counts)
    return f"{high}" if low == high else f"{low}–{high}"


def _text(cell: ScopeResults | None) -> Text:
    if cell is None:
        return Text("–", "dim")
    text = Text()
    # Pooled over trials: the gaps are over trials too.
    rate = cell.pooled_rate
    if rate is None:
        text.append("–", "dim")
    else:
        text.append(whole_percent(rate), _color(float(rate)))
        overlap = cell.explicit_overlap()
        if gap := gap_text(overlap):
            is_loss = overlap.only_first < overlap.only_second
            text.append(f" ({gap})", "red" if is_loss else "dim")
    if cell.errors:
        text.append(f" {cell.errors}{ERROR_MARK}", "bold yellow")
    if cell.missing:
        text.append(f" {cell.missing}{MISSING_MARK}", "yellow")
    return text


def _color(rate: float) -> str:
    return "green" if rate >= _GOOD else "yellow" if rate >= _FAIR else "red"
