"""The terminal's table of a run: tasks × settings, one for each policy run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

from rich.console import Console
from rich.text import Text

from roboirg.analysis.comparability import (
    AllDifferences,
    comparison_notes,
    differences_of,
)
from roboirg.analysis.measures.headline import headline_notes
from roboirg.analysis.measures.heard_rates import heard_notes
from roboirg.analysis.measures.measure import (
    ALL_TASKS,
    Measured,
    ScopeKey,
    ScopeSummary,
    by_scope,
    pair,
)
from roboirg.analysis.results.frame import Frame
from roboirg.analysis.results.option_labels import REFERENCE_OPTIONS, SortKey, options_sort_key
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.analysis.results.run_cells import CellKey, Cells, cells_of
from roboirg.analysis.tables.table import (
    ERROR_MARK,
    MISSING_MARK,
    SPARED_MARK,
    Column,
    Entry,
    Row,
    Table,
)
from roboirg.analysis.tables.table_notes import findings_of, range_text, where_played
from roboirg.core.arms import TOLD
from roboirg.core.instruction_options import InstructionOptions, options_label
from roboirg.core.plain_text import counted, printable
from roboirg.records.record import Summary
from roboirg.stats.cells import NOTHING, ByTask
from roboirg.stats.paired_tests import paired_rates
from roboirg.stats.rates import NOT_APPLICABLE, points, whole_percent

MAX_FAILURES = 10
"""Episodes of a policy that are listed below the tables."""

_GOOD = Fraction(3, 4)
_FAIR = Fraction(2, 5)
"""The smallest rates in green and in yellow."""


class _ScopeResult(NamedTuple):
    """What a policy run achieved in a scope with some options.

    Attributes:
        measured: its trials and their rate.
        gap: to explicit, as printed; empty without one.
    """

    measured: ScopeSummary
    gap: str


_RunResults = Mapping[str, Mapping[InstructionOptions, _ScopeResult]]
"""The results of a policy run by scope: its tasks, and last all tasks."""


def make_run_tables(frame: Frame) -> list[Table]:
    """Make a table of success by task and setting for each policy run.

    The last note of the last table is the legend of all.
    """
    cells = cells_of(frame)
    results_by_run = _results_by_run(cells)
    tables = []
    for policy_run, label in frame.names.items():
        names = {policy_run: label}  # the notes below a table are about its policy run alone
        differences = _explicit_differences(cells, policy_run)
        results = results_by_run[policy_run]
        notes = [f"{where_played([policy_run])} {_sizes(results)}"]
        notes += comparison_notes(differences, names)
        notes += heard_notes(frame.where(run=policy_run), names)
        notes += headline_notes(cells, names)
        tables.append(_make_run_table(label, results, differences, notes))
    if tables:
        last = tables[-1]
        legend = "; ".join(_legend(cells, results_by_run.values()))
        tables[-1] = replace(last, notes=(*last.notes, legend, *findings_of(frame)))
    return tables


def _results_by_run(cells: Cells) -> Mapping[PolicyRun, _RunResults]:
    """Return the success of each policy run, and its gap to explicit, by scope and options.

    A scope is here a task or all tasks; suites of tasks are left out.
    """
    scopes = by_scope(cells)
    results: dict[PolicyRun, dict[str, dict[InstructionOptions, _ScopeResult]]] = {}
    for key, by_task in scopes.items():
        is_suite = key.scope not in by_task and key.scope != ALL_TASKS
        if is_suite:
            continue
        by_options = results.setdefault(key.policy_run, {}).setdefault(key.scope, {})
        by_options[key.options] = _ScopeResult(Measured(key, by_task), gap_text(key, scopes))
    return results


def _explicit_differences(cells: Cells, policy_run: PolicyRun) -> AllDifferences:
    """Return why the rates of explicit instructions cannot be compared with published ones.

    For each task of a policy run, these are the conditions in which it was played differently, such
    as the step limit. Rates of other settings cannot be compared in any case.
    """
    differences = {}
    for key, cell in cells.items():
        if key.policy_run == policy_run and key.options == REFERENCE_OPTIONS:
            differences[key] = differences_of(key, cell)
    return differences


def print_failures(frame: Frame, console: Console) -> None:
    """Print up to `MAX_FAILURES` episodes without success of each policy run, and how many more.

    A policy run is a policy under one set of conditions and versions.
    """
    for run, label in frame.names.items():
        failures = [result for result in frame.where(run=run).played if result.outcome != "success"]
        failures.sort(key=_scene_order)
        if failures:
            title = f"{counted(len(failures), 'episode')} without success"
            console.print(Text.assemble((label, "bold"), f": {title}"), soft_wrap=True)
        for result in failures[:MAX_FAILURES]:
            console.print(Text(f"  {failure_text(result)}"), highlight=False, soft_wrap=True)
        if len(failures) > MAX_FAILURES:
            console.print(f"  and {len(failures) - MAX_FAILURES} more", highlight=False)


def _scene_order(result: Summary) -> SortKey:
    """Sort results in an order that is the same for any number of worker processes."""
    return result.task, result.split, result.episode, options_sort_key(result.options)


_NAMED_BY_A_MODEL = ("misunderstood", "no_answer")
"""Failures that a model's reply decides, whatever the hands do."""


def failure_text(result: Summary) -> str:
    """Return an episode without success in one line: which one, its options, and the cause.

    For example ``PickXtimes test/3 relational (policy seed 1): picked up the wrong cube``. What a
    model named instead of the goal follows the cause, which the hands alone do not explain.
    """
    text = f"{result.task} {result.split}/{result.episode} {options_label(result.options)}"
    if result.policy_seed:
        text += f" (policy seed {result.policy_seed})"
    if result.arm != TOLD:
        text += f" ({result.arm})"
    text += f": {printable(result.cause or result.outcome)}"
    found = result.attribution
    if found is not None and found.failure in _NAMED_BY_A_MODEL:
        text += f". {printable(found.sentence)}"
    if result.outcome == "error":
        text += f" {ERROR_MARK}"
    return text


def gap_text(key: ScopeKey, scopes: Mapping[ScopeKey, ByTask]) -> str:
    """Return by how many points success differs from that in explicit instructions: ``−12``.

    These name the goal. The gap is over the same episodes, and the mean over tasks. A dash if
    neither has a success, as such a gap says nothing. Empty for explicit itself, and if no episode
    was played in both settings.

    Args:
        key: policy run, scope (a task or all tasks) and instruction options.
        scopes: the results of all of these, by task.
    """
    reference = key._replace(options=REFERENCE_OPTIONS)
    if key == reference:
        return ""
    rates = paired_rates(pair(scopes[key], scopes.get(reference, NOTHING)))
    if rates is None:
        return ""
    if not any(rates):
        return NOT_APPLICABLE
    return points(rates.first - rates.second)


def _make_run_table(
    label: str, results: _RunResults, differences: AllDifferences, notes: Sequence[str]
) -> Table:
    """Return the table of a policy run, with a row for each task and a column for each setting.

    An entry is the success rate and, in brackets, the gap to explicit, the setting that names the
    goal: ``62 (−12)``.

    Args:
        label: of the policy run, the title.
        results: by scope, a task or all tasks, and by instruction options.
        differences: from the conditions of the published rates.
        notes: below the table.
    """
    settings = sorted(results[ALL_TASKS], key=options_sort_key)
    rows = []
    for scope, by_options in results.items():
        if scope != ALL_TASKS:
            group = ""
        elif _has_several_tasks(results):
            group = ALL_TASKS
        else:
            continue  # it would only repeat its task
        entries = []
        for options in settings:
            entries.append(_entry(by_options.get(options), differences))
        rows.append(Row(group, scope, entries))
    columns = [Column(options_label(options), options.setting) for options in settings]
    return Table(key="run", title=label, heads=("task",), columns=columns, rows=rows, notes=notes)


def _has_several_tasks(results: _RunResults) -> bool:
    return len(results.keys() - {ALL_TASKS}) > 1


def _entry(result: _ScopeResult | None, differences: AllDifferences) -> Entry:
    """Return an entry such as ``62 (−12)``: success in percent, in brackets the gap to explicit.

    It is a dash where nothing was played or planned, or no episode has a verdict.

    Args:
        result: of a policy run in a task, or all tasks, with some instruction options.
        differences: for the cells that have a published rate, how their conditions differ.
    """
    if result is None:
        return Entry(applies=False)
    measured = result.measured
    counts = measured.counts
    marks = []
    if counts.errors:
        marks.append(f"{counts.errors}{ERROR_MARK}")
    if counts.missing:
        marks.append(f"{counts.missing}{MISSING_MARK}")
    if counts.spared:
        marks.append(f"{counts.spared}{SPARED_MARK}")
    rate = measured.rate
    if rate is None:
        return Entry(word=NOT_APPLICABLE, marks=" ".join(marks))

    word = whole_percent(rate)
    if result.gap:
        word += f" ({result.gap})"
    return Entry(
        word=word,
        marks=" ".join(marks),
        differences=differences.get(CellKey(*measured.key)),
        style=_color(rate),
    )


def _color(rate: Fraction) -> str:
    if rate >= _GOOD:
        return "green"
    if rate >= _FAIR:
        return "yellow"
    return "red"


def _legend(cells: Cells, results_of_runs: Iterable[_RunResults]) -> Iterator[str]:
    """Yield the phrases of the legend: what numbers and signs mean that occur in the tables.

    Args:
        cells: the trials of all tables.
        results_of_runs: rates and gaps, as printed, of each table.
    """
    gaps: set[str] = set()
    for results in results_of_runs:
        for by_options in results.values():
            gaps.update(result.gap for result in by_options.values())
    if any(gaps):
        yield "success rate in %, in brackets the gap to explicit on the same episodes in points"
    else:
        yield "success rate in %"
    if NOT_APPLICABLE in gaps:
        yield f"({NOT_APPLICABLE}) explicit has no success either, so the gap says nothing"
    if any(cell.errors for cell in cells.values()):
        yield f"{ERROR_MARK} episodes ended in an error and are left out of the rates"
    if any(cell.missing for cell in cells.values()):
        yield f"{MISSING_MARK} episodes are still to be played"
    if any(cell.spared for cell in cells.values()):
        yield f"{SPARED_MARK} episodes need not be played: what is compared was decided before"
    if any(key.policy_run.is_privileged for key in cells):
        yield "privileged policies and scripted hands use the simulator's state"


def _sizes(results: _RunResults) -> str:
    """Return how many trials each rate is of: those of single tasks, and the mean over all tasks.

    For example ``n = 10 to 20 episodes per cell, 160 episodes for all tasks, the mean over tasks``.
    They are called episodes if each was played once.
    """
    of_cells: list[int] = []
    of_all_tasks: list[int] = []
    noun = "episode"
    for scope, by_options in results.items():
        trials = of_all_tasks if scope == ALL_TASKS else of_cells
        for result in by_options.values():
            counts = result.measured.counts
            trials.append(counts.trials)
            if counts.trials != counts.episodes:
                noun = "trial"
    text = f"n = {range_text(of_cells, noun)} per cell"
    if _has_several_tasks(results):
        text += f", {range_text(of_all_tasks, noun)} for {ALL_TASKS}, the mean over tasks"
    return text
