"""The terminal's table of a run: tasks × settings, one for each policy run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from rich.console import Console
from rich.text import Text

from roboirg.core.arms import TOLD
from roboirg.core.plain_text import counted, printable
from roboirg.evaluation.analysis.comparability import (
    AllDifferences,
    comparison_notes,
    differences_of,
)
from roboirg.evaluation.analysis.stats.cells import (
    CellKey,
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
    ScopeResults,
    group_by_scope,
)
from roboirg.evaluation.analysis.tables.rendering.terminal import renderable
from roboirg.evaluation.analysis.tables.table import (
    ERROR_MARK,
    MISSING_MARK,
    NOT_APPLICABLE,
    Column,
    Entry,
    Row,
    Table,
)
from roboirg.evaluation.analysis.tables.table_notes import where_played
from roboirg.evaluation.records.record import Job, Summary

MAX_FAILURES = 10
"""Episodes of a policy that are listed below the tables."""

_GOOD, _FAIR = 0.75, 0.4


RunTables = Mapping[PolicyRun, Table]
"""A table for each policy run, whose label is its title."""


def make_run_tables(records: Sequence[Summary], planned: Sequence[Job] = ()) -> RunTables:
    """Make a table for each policy run, in the order of the plan.

    Planned jobs without a record are counted as missing. What the signs mean is the last note of
    the last table.
    """
    found = gather([("", records)], planned)
    policies = list(dict.fromkeys(job.policy for job in (*planned, *records)))
    cells = sort_cells(found, policy_order(found, policies))
    results = [one for one in group_by_scope(cells) if one.scope.suite is None]
    heard = count_heard((PolicyRun.of(one), one) for one in records)
    names = labels(cells)
    tables = {}
    for policy_run, label in names.items():
        own = [one for one in results if one.policy_run == policy_run]
        # No other settings can be compared.
        differences = {
            key: differences_of(key, cell)
            for key, cell in cells.items()
            if key.policy_run == policy_run and key.options == REFERENCE
        }
        notes = (
            f"{where_played([policy_run.conditions])} {_sizes(own)}",
            *comparison_notes(differences, {policy_run: label}),
            *heard_notes(heard, {policy_run: label}),
            *headline_notes(cells, {policy_run: label}),
            *(["; ".join(_legend(results))] if policy_run == [*names][-1] else ()),
        )
        tables[policy_run] = _make_run_table(label, own, differences, notes)
    return tables


def print_run_tables(tables: RunTables, console: Console) -> None:
    for table in tables.values():
        console.print(renderable(table, console), highlight=False)


def print_failures(records: Iterable[Summary], tables: RunTables, console: Console) -> None:
    """List for each table the episodes without success and the cause; count the rest."""
    failed: dict[PolicyRun, list[Summary]] = {}
    for record in records:
        if record.outcome != "success":
            failed.setdefault(PolicyRun.of(record), []).append(record)
    for policy_run, table in tables.items():
        # The same order for any number of worker processes.
        failures = sorted(
            failed.get(policy_run, ()),
            key=lambda one: (one.task, one.split, one.episode, options_sort_key(one.options)),
        )
        if failures:
            title = f"{counted(len(failures), 'episode')} without success"
            console.print(Text.assemble((table.title, "bold"), f": {title}"), soft_wrap=True)
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
        return NOT_APPLICABLE
    return points((overlap.only_first - overlap.only_second) / overlap.trials)


def _make_run_table(
    label: str,
    results: Sequence[ScopeResults],
    differences: AllDifferences,
    notes: tuple[str, ...],
) -> Table:
    """Return tasks × settings: the success rate and, in brackets, the gap to explicit."""
    scopes = dict.fromkeys(one.scope for one in results if one.scope != ALL)
    options = sorted({one.options for one in results}, key=options_sort_key)
    cells = {(one.scope, one.options): one for one in results}
    return Table(
        key="run",
        title=label,
        heads=("task",),
        columns=tuple(Column(options_label(one), one.setting) for one in options),
        rows=tuple(
            Row(
                "" if scope.task else ALL_TASKS,
                scope.task or ALL_TASKS,
                [_entry(cells.get((scope, one)), differences) for one in options],
            )
            for scope in (*scopes, ALL)
            if scope != ALL or len(scopes) > 1
        ),
        notes=notes,
    )


def _entry(cell: ScopeResults | None, differences: AllDifferences) -> Entry:
    if cell is None:
        return Entry(applies=False)
    counts = ((cell.errors, ERROR_MARK), (cell.missing, MISSING_MARK))
    marks = " ".join(f"{count}{mark}" for count, mark in counts if count)
    # Pooled over trials: the gaps are over trials too.
    rate = cell.pooled_rate
    if rate is None:
        return Entry(word=NOT_APPLICABLE, marks=marks)
    gap = gap_text(cell.explicit_overlap())
    return Entry(
        word=whole_percent(rate) + (f" ({gap})" if gap else ""),
        marks=marks,
        differences=differences.get(CellKey(cell.policy_run, cell.scope.task or "", cell.options)),
        style="green" if rate >= _GOOD else "yellow" if rate >= _FAIR else "red",
    )


def _legend(cells: Sequence[ScopeResults]) -> Iterator[str]:
    """Yield what the signs mean that occur."""
    gaps = {gap_text(cell.explicit_overlap()) for cell in cells} - {""}
    compared = ", in brackets the gap to explicit on the same episodes in points"
    yield f"success rate in %{compared if gaps else ''}"
    if NOT_APPLICABLE in gaps:
        yield f"({NOT_APPLICABLE}) explicit has no success either, so the gap says nothing"
    if any(cell.errors for cell in cells):
        yield f"{ERROR_MARK} episodes ended in an error and are left out of the rates"
    if any(cell.missing for cell in cells):
        yield f"{MISSING_MARK} episodes are still to be played"
    if any(cell.policy_run.is_privileged for cell in cells):
        yield "privileged policies and scripted hands use the simulator's state"


def _sizes(results: Sequence[ScopeResults]) -> str:
    single = [one.trials for one in results if one.scope != ALL]
    text = f"n = {_range(single)} {'episode' if max(single) == 1 else 'episodes'} per cell"
    if len({one.scope for one in results}) > 2:  # noqa: PLR2004 - a task and all of them
        text += f", {_range([one.trials for one in results if one.scope == ALL])} for {ALL_TASKS}"
    return text


def _range(counts: Sequence[int]) -> str:
    low, high = min(counts), max(counts)
    return f"{high}" if low == high else f"{low}–{high}"
