"""The tables of the paper: main, planners, context, real world, coverage."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Literal, NamedTuple, get_args

import numpy as np

from roboirg.core.errors import UnknownNameError
from roboirg.core.instruction_options import ALL_STAGES, InstructionOptions
from roboirg.evaluation.analysis.comparability import AllDifferences, differences_of
from roboirg.evaluation.analysis.published import (
    AVERAGE,
    RATE_TABLES,
    PublishedRow,
    RateTable,
    published_coverage,
    published_rows,
    published_tasks,
)
from roboirg.evaluation.analysis.stats.cells import (
    CellKey,
    Cells,
    PolicyRun,
    cell_interval,
    labels,
    only_told,
)
from roboirg.evaluation.analysis.stats.chance import floor_level
from roboirg.evaluation.analysis.stats.intervals import SEED
from roboirg.evaluation.analysis.stats.option_labels import setting_sort_key, staged_options
from roboirg.evaluation.analysis.stats.rates import percent
from roboirg.evaluation.analysis.tables.table import (
    ERROR_MARK,
    MISSING_MARK,
    POLICY,
    Column,
    Counts,
    Entry,
    Row,
    Table,
    with_averages,
    with_best,
    with_changes,
)
from roboirg.evaluation.analysis.tables.table_notes import (
    TWIN_MARK,
    average_notes,
    is_shown,
    notes_of,
)
from roboirg.evaluation.records.record import Job
from roboirg.language.settings import EXPLICIT, all_settings, settings_of
from roboirg.tasks import all_tasks, every_task

Which = Literal["main", "planner", "context", "real", "harder", "other", "coverage"]
WHICH: tuple[Which, ...] = get_args(Which)

OVERALL = AVERAGE
OWN_NAME = "RoboIRGBench"

TITLES: Mapping[Which, str] = {
    "main": "Success by task and setting",
    "planner": "High-level planners",
    "context": "Stages of the contextual setting",
    "real": "Real world",
    "harder": "Harder settings",
    "other": "Tasks outside the paper",
    "coverage": "Implicit references in benchmarks",
}


class Position(NamedTuple):
    """The group and name of a row, and the options of its instructions."""

    group: str
    name: str
    options: InstructionOptions


def make_table(
    which: str,
    cells: Cells,
    *,
    published: bool = False,
    floors: Sequence[str] = (),
) -> Table:
    """Make one of the paper's tables.

    Args:
        which: main, planner, context, real, harder, other or coverage.
        cells: as `gather` makes them; may be empty if published rows are shown.
        published: whether to add the paper's rows, and to say which rates can be compared.
        floors: those of `FLOORS` whose expected success is added below the policies.
    """
    cells = only_told(cells)
    for known in WHICH:
        if which == known:
            if known == "coverage":
                return _coverage()
            return _rate_table(known, cells, published=published, floors=floors)
    raise UnknownNameError("table", which, WHICH)


def is_informative(which: Which, cells: Cells) -> bool:
    """Return whether a run has rows for a table; context needs several, planners one of these."""
    if which == "coverage":
        return False
    rows = list(_positions(which, only_told(cells)))
    if which == "planner":
        runs = {policy_run for policy_run, _ in rows}
        return len(runs) > 1 and any(one.has_planner for one in runs)
    if which == "context":
        return len({position.options for _, position in rows}) > 1
    # Explicit alone is a reference, but nothing to read.
    return any(which != "harder" or one.options.setting != EXPLICIT for _, one in rows)


def _rate_table(which: RateTable, cells: Cells, *, published: bool, floors: Sequence[str]) -> Table:
    tasks = _tasks(which, cells)
    columns = _columns(which, tasks)
    rng = np.random.default_rng(SEED)
    shows_published = published and which in RATE_TABLES
    differences: AllDifferences = (
        {key: differences_of(key, cell) for key, cell in cells.items()} if shows_published else {}
    )
    rows = []
    for policy_run, position in _positions(which, cells):
        keys = [CellKey(policy_run, task, position.options) for task in tasks]
        entries = {key.task: _entry(key, cells, differences, rng) for key in keys}
        rows.append(Row(position.group, position.name, with_averages(columns, entries)))
    for floor in floors:
        rows += _floor_rows(floor, which, columns, cells)
    if shows_published:
        rows += [_published_row(which, columns, row) for row in published_rows(which)]
    reference_of = _reference_finder(which, rows)
    rows = [*with_best(with_changes(columns, _grouped(which, rows), reference_of))]
    return Table(
        key=which,
        title=TITLES[which],
        heads=_heads(which),
        columns=columns,
        rows=tuple(_by_policy(rows) if which == "planner" else rows),
        notes=(
            *notes_of(which, rows, cells, tasks, differences),
            *average_notes(columns, rows, reference_of),
        ),
    )


def _heads(which: RateTable) -> tuple[str, ...]:
    if which == "context":
        return (POLICY, *map(str, ALL_STAGES))
    return (POLICY, "setting") if which == "planner" else ("setting", POLICY)


def _tasks(which: RateTable, cells: Cells) -> tuple[str, ...]:
    """Return the tasks of a table: the paper's, or all others that were played."""
    if which != "other":
        return published_tasks("main" if which == "harder" else which)
    known = {*published_tasks("main"), *published_tasks("real")}
    installed = [*every_task()]
    played = {key.task for key in cells} - known
    return tuple(sorted(played, key=lambda task: (task not in installed, task)))


def _columns(which: RateTable, tasks: Sequence[str]) -> tuple[Column, ...]:
    """Return the tasks, of the main tasks by suite with its average; the overall average last."""
    if which not in ("main", "harder"):
        return (*(Column(task) for task in tasks), Column(OVERALL, averages=tuple(tasks)))
    registry = all_tasks()
    suites: dict[str, list[str]] = {}
    for task in tasks:
        suites.setdefault(registry[task].suite, []).append(task)
    columns: list[Column] = []
    for suite, names in suites.items():
        group = suite.capitalize()
        columns += [Column(name, group) for name in names]
        columns.append(Column(f"{group} {AVERAGE}", group, tuple(names)))
    return (*columns, Column(OVERALL, averages=tuple(tasks)))


def _positions(which: RateTable, cells: Cells) -> Iterator[tuple[PolicyRun, Position]]:
    """Yield the position of each row, by policy run and instruction options."""
    tasks = set(_tasks(which, cells))
    played = {(key.policy_run, key.options) for key in cells if key.task in tasks}
    shown = _shown_options(which, (options for _, options in played))
    for policy_run, label in labels(cells).items():
        mark = TWIN_MARK if which == "real" and policy_run.robot is None else ""
        for options in shown:
            if (policy_run, options) in played:
                yield policy_run, _position(which, label + mark, options)


def _shown_options(
    which: RateTable, played: Iterable[InstructionOptions]
) -> Sequence[InstructionOptions]:
    """Return the options that a table has rows for, in order."""
    if which == "context":
        return staged_options()
    shown = {options for options in played if is_shown(which, options)}
    return sorted(shown, key=lambda options: setting_sort_key(options.setting))


def _position(which: RateTable, policy: str, options: InstructionOptions) -> Position:
    if which == "context":
        return Position(policy, _stages(options), options)
    return Position(options.setting, policy, options)


def _stages(options: InstructionOptions) -> str:
    return ",".join(map(str, options.stages))


def _entry(
    key: CellKey, cells: Cells, differences: AllDifferences, rng: np.random.Generator
) -> Entry:
    cell = cells.get(key)
    if cell is None:
        return Entry(applies=_applies(key.task, key.options))
    marks = (ERROR_MARK if cell.errors else "") + (MISSING_MARK if cell.missing else "")
    return Entry(
        percent=None if cell.rate is None else percent(cell.rate),
        marks=marks,
        counts=Counts(
            cell.successes,
            cell.trials,
            len(cell.by_episode()),
            cell.errors,
            cell.missing,
            cell_interval(cell, rng),
        ),
        differences=differences.get(key),
    )


def _applies(task: str, options: InstructionOptions) -> bool:
    """Whether a task has a setting; taken for granted if either is not installed."""
    known = every_task().get(task)
    is_known = known is not None and options.setting in all_settings()
    return known is None or not is_known or options.setting in settings_of(known)


def _floor_rows(floor: str, which: RateTable, columns: Sequence[Column], cells: Cells) -> list[Row]:
    """Return a floor of each setting on the episodes that any policy played in it."""
    rows: list[Row] = []
    if which == "context":
        return rows
    for options in dict.fromkeys(position.options for _, position in _positions(which, cells)):
        entries = {}
        for task in _tasks(which, cells):
            level = _floor(floor, task, options, cells)
            entries[task] = Entry(
                None if level is None else percent(level), applies=_applies(task, options)
            )
        if any(entry.percent is not None for entry in entries.values()):
            rows.append(Row(options.setting, floor, with_averages(columns, entries), "chance"))
    return rows


def _floor(floor: str, task: str, options: InstructionOptions, cells: Cells) -> Fraction | None:
    if task not in every_task() or options.setting not in all_settings():
        return None
    return floor_level(
        floor,
        (
            Job(
                policy="",
                task=task,
                split=key.policy_run.conditions.split,
                episode=trial.episode,
                options=options,
            )
            for key, cell in cells.items()
            if (key.task, key.options) == (task, options)
            for trial in cell.verdicts
        ),
    )


def _published_row(which: RateTable, columns: Sequence[Column], row: PublishedRow) -> Row:
    entries = with_averages(
        columns,
        {task: Entry(percent=rate, applies=rate is not None) for task, rate in row.rates.items()},
    )
    position = _position(which, row.model, row.options)
    # The paper prints the overall average, but no averages of suites.
    entries = (*entries[:-1], Entry(percent=row.average))
    return Row(position.group, position.name, entries, "published")


def _grouped(which: RateTable, rows: Iterable[Row]) -> list[Row]:
    """Put the rows of each group together: settings in their order, policies as they come."""
    found = list(rows)
    groups = list(dict.fromkeys(row.group for row in found))
    if which != "context":
        groups.sort(key=setting_sort_key)
    return [row for group in groups for row in found if row.group == group]


def _by_policy(rows: Sequence[Row]) -> list[Row]:
    """Return rows that are grouped by setting grouped by policy instead."""
    owners = list(dict.fromkeys((row.source, row.name) for row in rows))
    found = sorted(rows, key=lambda row: owners.index((row.source, row.name)))
    return [replace(row, group=row.name, name=row.group) for row in found]


def _reference_finder(which: RateTable, rows: Sequence[Row]) -> Callable[[Row], Row | None]:
    """Return a function that finds a row's reference: explicit, or the shortest context."""
    by_position = {(row.group, row.name, row.source): row for row in rows}
    shortest = _stages(staged_options()[0])

    def reference_of(row: Row) -> Row | None:
        if row.source == "chance":
            return None
        if which == "context":
            found = by_position.get((row.group, shortest, row.source))
        else:
            found = by_position.get((EXPLICIT, row.name, row.source))
        is_itself = found is not None and (found.group, found.name) == (row.group, row.name)
        return None if is_itself else found

    return reference_of


def _coverage() -> Table:
    """Return the paper's table with this benchmark's row derived from its tasks."""
    rows = published_coverage()
    kinds = tuple(rows[0].covers)
    has = {setting for task in all_tasks().values() for setting in settings_of(task)}
    table_rows = []
    for row in rows:
        words = ["yes" if kind in has else "no" for kind in kinds]
        is_own = row.benchmark == OWN_NAME
        cells = words if is_own else [*row.covers.values()]
        table_rows.append(Row(row.kind, row.benchmark, cells, "ours" if is_own else "cited"))
    return Table(
        key="coverage",
        title=TITLES["coverage"],
        heads=("kind", "benchmark"),
        columns=tuple(Column(kind) for kind in kinds),
        rows=tuple(table_rows),
        notes=("partial: pronouns within a chain of actions only. Source: the paper.",),
    )
