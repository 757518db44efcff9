"""The tables of the paper: main, planners, context, real world, coverage, and two like them."""

from __future__ import annotations

import operator
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

from roboirg.analysis.comparability import differences_of
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.published import (
    published_lines,
    published_rows,
)
from roboirg.analysis.results.option_labels import (
    REFERENCE_OPTIONS,
    SortKey,
    setting_sort_key,
)
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.analysis.results.run_cells import CellKey, Cells
from roboirg.analysis.tables.table import (
    ERROR_MARK,
    MISSING_MARK,
    POLICY,
    SPARED_MARK,
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
from roboirg.analysis.tables.table_kinds import (
    PAPER_TABLES,
    PaperTable,
    TableResults,
    row_order,
)
from roboirg.analysis.tables.table_notes import notes_of
from roboirg.core.errors import check_names
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.settings import all_settings, settings_of
from roboirg.records.record import Job
from roboirg.stats.cells import rate_interval
from roboirg.stats.rates import percent
from roboirg.tasks import all_tasks, every_task

OWN_NAME = "RoboIRGBench"
COVERAGE = "coverage"

WHICH = (*PAPER_TABLES, COVERAGE)

_read_fairness = operator.attrgetter(
    "conditions.split",
    "conditions.wordings",
    "conditions.environment.max_steps",
    "conditions.environment.meshes",
    "language",
    "versions.environment_version",
)
"""Returns what must be equal in a comparison of policies, as in `roboirg.records.mixing`."""


def make_table(
    which: str, data: RunData, *, published: bool = False, floors: Sequence[str] = ()
) -> Table:
    """Make one of the paper's tables.

    Args:
        which: main, planner, context, real, harder, other or coverage.
        data: results, of which control arms are left out; without any, the table has no rows of
            policies that were played.
        published: whether to add the paper's rows, and to say which rates can be compared.
        floors: names of listeners that do not understand, such as ``chance``, whose expected
            success is added below the policies.
    """
    if which == COVERAGE:
        return _coverage()
    check_names("table", [which], WHICH)
    table = PAPER_TABLES[which]
    # The harder settings have the tasks of a table of the paper, but no published rates.
    shows_published = published and table.of_paper == table.name
    results = _results_of(table, data.without_control_arms, with_differences=shows_published)
    columns = table.columns(results.tasks)
    rows = _policy_rows(table, columns, results)
    if not table.is_by_stages:
        for floor in floors:
            rows += _floor_rows(floor, columns, results)
    if shows_published:
        rows += _published_rows(table, columns)
    rows = list(with_best(_compared_rows(table, columns, _in_order(table, rows))))
    notes = notes_of(table, columns, rows, results, floors)
    if table.heads == (POLICY, "setting"):
        # Last, because the best policy was sought among a setting's rows, which this divides.
        rows = _by_policy(rows)
    return Table(table.name, table.title, table.heads, columns, rows, notes)


def _in_order(table: PaperTable, rows: Sequence[Row]) -> Sequence[Row]:
    """Return rows sorted by setting; those of stages stay as they are."""
    if table.is_by_stages:
        return rows
    return sorted(rows, key=lambda row: setting_sort_key(row.group))


def _results_of(table: PaperTable, data: RunData, *, with_differences: bool) -> TableResults:
    """Return the results that a table of the paper shows.

    Args:
        table: which one.
        data: of all that was played.
        with_differences: whether to find out, for each rate, how the conditions differ from those
            of the published rate.
    """
    shown = table.shown(data.cells)
    differences = {}
    if with_differences:
        differences = {key: differences_of(key, cell) for key, cell in shown.items()}
    tasks = table.tasks(data.cells)
    return TableResults(tasks, data.cells, shown, data.frame.names_as_played, differences)


def is_informative(which: str, data: RunData) -> bool:
    """Return whether a run has enough rows to make a table worth printing.

    The table of planners needs several policy runs, one of them with a planner; that of contexts
    needs several contexts, and the harder one a setting other than explicit.
    """
    if which == COVERAGE:
        return False
    shown = PAPER_TABLES[which].shown(data.without_control_arms.cells)
    options = {key.options for key in shown}
    if which == "planner":
        runs = {key.policy_run for key in shown}
        return len(runs) > 1 and any(run.has_planner for run in runs)
    if which == "context":
        return len(options) > 1
    if which == "harder":
        # Explicit alone is a reference, but nothing to read.
        options.discard(REFERENCE_OPTIONS)
    return bool(options)


def _policy_rows(table: PaperTable, columns: Sequence[Column], results: TableResults) -> list[Row]:
    """Return a row for each policy run and set of options of a table: its rate in each task.

    Averages over tasks are added where the table has columns for them.
    """
    options_of_runs = defaultdict(set)
    for key in results.shown:
        options_of_runs[key.policy_run].add(key.options)
    rows = []
    for policy_run, name in results.names.items():
        label = table.label(policy_run, name)
        for options in sorted(options_of_runs[policy_run], key=row_order):
            entries = _entries(policy_run, options, results)
            row = table.row(options, label, with_averages(columns, entries))
            rows.append(replace(row, conditions=_read_fairness(policy_run)))
    return rows


def _entries(
    policy_run: PolicyRun, options: InstructionOptions, results: TableResults
) -> dict[str, Entry]:
    """Return the entries of a policy run's row, by task."""
    keys = [CellKey(policy_run, task, options) for task in results.tasks]
    return {key.task: _entry(key, results) for key in keys}


def _entry(key: CellKey, results: TableResults) -> Entry:
    """Return the table's entry for a policy in a task and setting: rate, interval, and marks.

    Marks show that some trials ended in an error or are missing. Without a planned episode the
    entry is empty, or a dash if the task does not have the setting.
    """
    cell = results.shown.get(key)
    if cell is None:
        return Entry(applies=_applies(key.task, key.options))
    marks = ""
    if cell.errors:
        marks += ERROR_MARK
    if cell.missing:
        marks += MISSING_MARK
    if key.policy_run.is_until_decided:
        marks += SPARED_MARK
    rate = cell.rate
    return Entry(
        percent=None if rate is None else percent(rate),
        marks=marks,
        counts=cell.counts,
        interval=None if key.policy_run.is_until_decided else rate_interval([cell]),
        differences=results.differences.get(key),
        episodes=frozenset(cell.by_episode()),
    )


def _applies(task: str, options: InstructionOptions) -> bool:
    """Whether a task has a setting; taken for granted if either is not installed."""
    installed = every_task().get(task)
    if installed is None or options.setting not in all_settings():
        return True
    return options.setting in settings_of(installed)


def _floor_rows(floor: str, columns: Sequence[Column], results: TableResults) -> Iterator[Row]:
    """Yield rows with the expected success of a listener that does not understand instructions.

    There is a row for each setting and split that any policy played, over the same episodes; none
    where the floor was not measured.

    Args:
        floor: which listener, such as ``chance``.
        columns: of the table.
        results: of the policies.
    """
    judged = {key: cell for key, cell in results.shown.items() if cell.verdicts}
    language = _only_language(judged)
    jobs_by_words = _jobs_by_instructions(judged)
    has_several_splits = len({words.split for words in jobs_by_words}) > 1
    for words in sorted(jobs_by_words, key=_instruction_order):
        name = floor
        if has_several_splits:
            name += f", split {words.split}"
        jobs = jobs_by_words[words]
        entries = _floor_entries(floor, words.options, results.tasks, jobs, language)
        if any(entry.percent is not None for entry in entries.values()):
            yield Row(words.options.setting, name, with_averages(columns, entries), "chance")


def _only_language(cells: Iterable[CellKey]) -> str:
    """Return the version of the language in which some cells were played; empty with several.

    What learners reach was measured for each version, so of several it is unknown.
    """
    languages = {key.policy_run.language for key in cells}
    return languages.pop() if len(languages) == 1 else ""


def _floor_entries(
    floor: str,
    options: InstructionOptions,
    tasks: Sequence[str],
    jobs: Sequence[Job],
    language: str,
) -> dict[str, Entry]:
    """Return the expected success of a listener that does not understand, in each task.

    Args:
        floor: which listener, such as ``chance``.
        options: of the instructions.
        tasks: of the table.
        jobs: the episodes of all tasks over which it is the mean.
        language: version of the language that was played; empty if there are several.
    """
    # Imported here because it brings the reader's patterns, which delay every command.
    from roboirg.analysis.measures.chance import floor_level

    entries = {}
    for task in tasks:
        jobs_of_task = [job for job in jobs if job.task == task]
        level = floor_level(floor, jobs_of_task, language)
        rate = None if level is None else percent(level)
        entries[task] = Entry(rate, applies=_applies(task, options))
    return entries


class _Instructions(NamedTuple):
    """The split whose instructions are meant, and the options that word them."""

    split: str
    options: InstructionOptions


def _instruction_order(instructions: _Instructions) -> SortKey:
    return row_order(instructions.options), instructions.split


def _jobs_by_instructions(cells: Cells) -> dict[_Instructions, list[Job]]:
    """Return which episodes have a verdict, by split and instruction options.

    They are jobs without a policy, because their instructions do not depend on it. Those of tasks
    and settings that are not installed are left out, as they cannot be worded.
    """
    jobs: defaultdict[_Instructions, list[Job]] = defaultdict(list)
    for (policy_run, task, options), cell in cells.items():
        split = policy_run.conditions.split
        jobs_of_instructions = jobs[_Instructions(split, options)]
        if task not in every_task() or options.setting not in all_settings():
            continue
        for episode in cell.by_episode():
            job = Job(policy="", task=task, split=split, episode=episode, options=options)
            jobs_of_instructions.append(job)
    return jobs


def _published_rows(table: PaperTable, columns: Sequence[Column]) -> Iterator[Row]:
    """Yield the rates of published policies as rows of the table, next to played policies.

    Averages over suites, which the paper lacks, are computed from its rates.
    """
    for published in published_rows(table.name):
        entries = {}
        for task, rate in published.rates.items():
            entries[task] = Entry(percent=rate, applies=rate is not None)
        cells = list(with_averages(columns, entries))
        # The last column is the overall average; it is kept as the paper prints it.
        cells[-1] = Entry(percent=published.average)
        row = table.row(published.options, published.model, cells)
        yield replace(row, source="published")


def _by_policy(rows: Sequence[Row]) -> list[Row]:
    """Regroup rows: from a group for each setting with rows of policies to the reverse.

    Published policies are apart from played ones of the same name.
    """
    swapped = []
    for group in grouped(rows, lambda row: (row.source, row.name)):
        for row in group:
            swapped.append(replace(row, group=row.name, name=row.group))
    return swapped


def _compared_rows(
    table: PaperTable, columns: Sequence[Column], rows: Sequence[Row]
) -> Iterator[Row]:
    """Yield rows with the change of each rate from the same policy's reference row.

    The reference is explicit, or in the table of contexts the shortest context. Reference rows
    themselves have no changes, nor have rows of expected success, which are of no policy.
    """
    rows_by_position = {row.position: row for row in rows}
    for row in rows:
        reference = rows_by_position.get(table.reference_position(row), row)  # itself if absent
        if reference.position == row.position or row.source == "chance":
            yield row
        else:
            yield with_changes(columns, row, reference)


def _coverage() -> Table:
    """Return the paper's table of which benchmark has which kind of implicit instructions.

    Its texts are ``yes``, ``no`` or ``partial``. The row of this benchmark is not taken from the
    paper, but from the settings of its tasks.
    """
    lines = published_lines(COVERAGE)
    settings = [name for name in lines[0] if name not in ("kind", "benchmark")]
    our_settings: set[str] = set()
    for task in all_tasks().values():
        our_settings.update(settings_of(task))
    rows = []
    for line in lines:
        source: Source = "cited"
        if line["benchmark"] == OWN_NAME:
            source = "ours"
            for setting in settings:
                line[setting] = "yes" if setting in our_settings else "no"
        words = [line[setting] for setting in settings]
        rows.append(Row(line["kind"], line["benchmark"], words, source))
    return Table(
        key=COVERAGE,
        title="Implicit references in benchmarks",
        heads=("kind", "benchmark"),
        columns=named_columns(*settings),
        rows=rows,
        notes=("partial: pronouns within a chain of actions only. Source: the paper.",),
    )
