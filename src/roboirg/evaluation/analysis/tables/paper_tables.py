"""The tables of the paper: main, planners, context, real world, coverage, and two like them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from roboirg.core.errors import check_names
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.comparability import AllDifferences, differences_of
from roboirg.evaluation.analysis.published import (
    PublishedRow,
    published_lines,
    published_rows,
)
from roboirg.evaluation.analysis.results.frame import RunNames
from roboirg.evaluation.analysis.results.option_labels import (
    reference_of,
    setting_sort_key,
    staged_options,
)
from roboirg.evaluation.analysis.stats.cells import Cell, CellKey, Cells, cell_interval
from roboirg.evaluation.analysis.stats.chance import floor_level
from roboirg.evaluation.analysis.stats.intervals import SEED
from roboirg.evaluation.analysis.stats.rates import percent
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.table import (
    ERROR_MARK,
    MISSING_MARK,
    POLICY,
    Column,
    Entry,
    Row,
    Source,
    Table,
    grouped,
    named_columns,
    with_averages,
    with_best,
    with_changes,
)
from roboirg.evaluation.analysis.tables.table_kinds import (
    PAPER_TABLES,
    PaperTable,
    row_order,
    stages_text,
)
from roboirg.evaluation.analysis.tables.table_notes import notes_of
from roboirg.evaluation.records.record import Job
from roboirg.language.settings import EXPLICIT, all_settings, settings_of
from roboirg.tasks import all_tasks, every_task

OWN_NAME = "RoboIRGBench"
COVERAGE = "coverage"

WHICH = (*PAPER_TABLES, COVERAGE)


def make_table(
    which: str, data: RunData | None, *, published: bool = False, floors: Sequence[str] = ()
) -> Table:
    """Make one of the paper's tables.

    Args:
        which: main, planner, context, real, harder, other or coverage.
        data: results, of which control arms are left out; None if only published rows are shown.
        published: whether to add the paper's rows, and to say which rates can be compared.
        floors: those of `FLOORS` whose expected success is added below the policies.
    """
    if which == COVERAGE:
        return _coverage()
    check_names("table", [which], WHICH)
    names: RunNames = {} if data is None else data.told.frame.names_as_played
    cells: Cells = {} if data is None else data.told.cells
    table = PAPER_TABLES[which]
    tasks = table.tasks(cells)
    columns = table.columns(tasks)
    shows_published = published and table.of_paper == table.name
    differences: AllDifferences = (
        {key: differences_of(key, cell) for key, cell in cells.items()} if shows_published else {}
    )
    rng = np.random.default_rng(SEED)
    rows: list[Row] = []
    for policy_run, options, label in table.positions(cells, names):
        keys = [CellKey(policy_run, task, options) for task in tasks]
        entries = {key.task: _entry(key, cells.get(key), differences, rng) for key in keys}
        rows.append(table.row(options, label, with_averages(columns, entries)))
    for floor in floors if not table.is_by_stages else ():
        rows.extend(_floor_rows(floor, table, columns, cells))
    if shows_published and table.of_paper is not None:
        rows += [_published_row(table, columns, row) for row in published_rows(table.of_paper)]
    if not table.is_by_stages:
        rows.sort(key=lambda row: setting_sort_key(row.group))
    rows = list(with_best(with_changes(columns, zip(rows, _references(table, rows), strict=True))))
    return Table(
        key=table.name,
        title=table.title,
        heads=table.heads,
        columns=columns,
        rows=_by_policy(rows) if table.heads == (POLICY, "setting") else rows,
        notes=notes_of(table, columns, rows, cells, names, differences, floors),
    )


def is_informative(which: str, data: RunData) -> bool:
    """Return whether a run has rows for a table; context needs several, planners one of these."""
    if which == COVERAGE:
        return False
    rows = list(PAPER_TABLES[which].positions(data.told.cells, data.told.frame.names))
    if which == "planner":
        runs = {policy_run for policy_run, _, _ in rows}
        return len(runs) > 1 and any(one.has_planner for one in runs)
    if which == "context":
        return len({options for _, options, _ in rows}) > 1
    # Explicit alone is a reference, but nothing to read.
    return any(which != "harder" or options != reference_of(options) for _, options, _ in rows)


def _entry(
    key: CellKey, cell: Cell | None, differences: AllDifferences, rng: np.random.Generator
) -> Entry:
    if cell is None:
        return Entry(applies=_applies(key.task, key.options))
    return Entry(
        percent=None if cell.rate is None else percent(cell.rate),
        marks=ERROR_MARK * bool(cell.errors) + MISSING_MARK * bool(cell.missing),
        counts=cell.counts,
        interval=cell_interval(cell, rng),
        differences=differences.get(key),
    )


def _applies(task: str, options: InstructionOptions) -> bool:
    """Whether a task has a setting; taken for granted if either is not installed."""
    known = every_task().get(task)
    setting = options.setting
    return known is None or setting not in all_settings() or setting in settings_of(known)


def _floor_rows(
    floor: str, table: PaperTable, columns: Sequence[Column], cells: Cells
) -> Iterator[Row]:
    """Yield a floor of each setting on the episodes that any policy played in it."""
    tasks = table.tasks(cells)
    played: defaultdict[_Instructions, defaultdict[str, list[Job]]]
    played = defaultdict(lambda: defaultdict(list))
    for key, cell in cells.items():
        if key.task in tasks and table.shows(key.options) and cell.verdicts:
            run = key.policy_run
            words = _Instructions(run.language, run.conditions.split, key.options)
            played[words][key.task] += _jobs(key, cell)
    several_languages = len({words.language for words in played}) > 1
    several_splits = len({words.split for words in played}) > 1
    for words in sorted(played, key=lambda words: (row_order(words.options), *words[:2])):
        entries = {}
        for task in tasks:
            level = floor_level(floor, played[words][task], words.language)
            applies = _applies(task, words.options)
            entries[task] = Entry(None if level is None else percent(level), applies=applies)
        if any(entry.percent is not None for entry in entries.values()):
            name = floor
            if several_languages:
                name += f", language {words.language}"
            if several_splits:
                name += f", split {words.split}"
            yield Row(words.options.setting, name, with_averages(columns, entries), "chance")


class _Instructions(NamedTuple):
    """What instructions are of: a version of the language, a split, and options."""

    language: str
    split: str
    options: InstructionOptions


def _jobs(key: CellKey, cell: Cell) -> Iterator[Job]:
    """Yield the episodes with a verdict of a cell, if its task and setting are installed."""
    if key.task in every_task() and key.options.setting in all_settings():
        split = key.policy_run.conditions.split
        for episode in cell.by_episode():
            yield Job(policy="", task=key.task, split=split, episode=episode, options=key.options)


def _published_row(table: PaperTable, columns: Sequence[Column], row: PublishedRow) -> Row:
    entries = with_averages(
        columns,
        {task: Entry(percent=rate, applies=rate is not None) for task, rate in row.rates.items()},
    )
    # The paper prints the overall average, but no averages of suites.
    cells = (*entries[:-1], Entry(percent=row.average))
    return replace(table.row(row.options, row.model, cells), source="published")


def _by_policy(rows: Sequence[Row]) -> list[Row]:
    """Return rows that are grouped by setting grouped by policy instead."""
    groups = grouped(rows, lambda row: (row.source, row.name))
    return [replace(row, group=row.name, name=row.group) for group in groups for row in group]


def _references(table: PaperTable, rows: Sequence[Row]) -> Iterator[Row | None]:
    """Yield each row's reference: explicit, or the shortest context."""
    by_position = {(row.group, row.name, row.source): row for row in rows}
    shortest = stages_text(staged_options()[0])
    for row in rows:
        place = (row.group, shortest) if table.is_by_stages else (EXPLICIT, row.name)
        is_itself = place == (row.group, row.name) or row.source == "chance"
        yield None if is_itself else by_position.get((*place, row.source))


def _coverage() -> Table:
    """Return the paper's table with this benchmark's row derived from its tasks."""
    has = {setting for task in all_tasks().values() for setting in settings_of(task)}
    rows = []
    for line in published_lines(COVERAGE):
        kind = line.pop("kind")
        benchmark = line.pop("benchmark")
        words = list(line.values())
        source: Source = "cited"
        if benchmark == OWN_NAME:
            words = ["yes" if setting in has else "no" for setting in line]
            source = "ours"
        rows.append(Row(kind, benchmark, words, source))
    return Table(
        key=COVERAGE,
        title="Implicit references in benchmarks",
        heads=("kind", "benchmark"),
        columns=named_columns(*line),
        rows=rows,
        notes=("partial: pronouns within a chain of actions only. Source: the paper.",),
    )
