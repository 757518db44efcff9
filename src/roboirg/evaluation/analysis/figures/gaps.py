"""Figures: success in each implicit setting, and with each longer context, next to a reference.

The reference is explicit instructions, or the shortest context. In a panel, all policies are
compared on the tasks that all of them played; published ones stand apart, below a line.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.comparability import (
    COMPARABLE_SIGN,
    DIFFERENT_SIGN,
    AllDifferences,
    comparison_notes,
    comparison_sign,
    differences_of,
)
from roboirg.evaluation.analysis.figures.rates import Rate, RateRow, draw_rates
from roboirg.evaluation.analysis.published import TRIALS, RateTable, published_rows
from roboirg.evaluation.analysis.results.option_labels import (
    REFERENCE,
    setting_sort_key,
    staged_options,
)
from roboirg.evaluation.analysis.results.policy_run import PolicyRun
from roboirg.evaluation.analysis.stats.cells import ByTask, CellKey, Cells
from roboirg.evaluation.analysis.stats.measure import measure_groups
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.table_kinds import PAPER_TABLES
from roboirg.evaluation.analysis.tables.table_notes import where_played

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NO_BREAK = "\N{NO-BREAK SPACE}"
SIZE_NOTE = "n: episodes per task and setting, × policy seeds if there are several."
PUBLISHED_NOTE = "published: the same tasks, the paper's instructions and simulator."

Tasks = Mapping[InstructionOptions, Sequence[str]]
"""The tasks of each column."""


class DrawnTable(NamedTuple):
    """The rates of a published table and the options that they are compared with."""

    table: RateTable
    reference: InstructionOptions

    def title(self, options: InstructionOptions) -> str:
        stages = ",".join(map(str, options.stages))
        return options.setting if self.table == "main" else f"stages {stages}"


def draw_gaps(content: RunData, *, published: bool = False) -> Figure | None:
    """Draw the implicit settings next to explicit; rates alone where either was not played."""
    words = "success", "success with explicit instructions", "with implicit ones"
    return _draw(content, DrawnTable("main", REFERENCE), words, published=published)


def draw_context(content: RunData, *, published: bool = False) -> Figure | None:
    """Draw success by the stages of the contextual discourse that are spoken."""
    kind = DrawnTable("context", staged_options()[0])
    words = "success", f"success with {kind.title(kind.reference)}", "with more stages"
    return _draw(content, kind, words, published=published)


def _draw(
    content: RunData, kind: DrawnTable, words: tuple[str, str, str], *, published: bool
) -> Figure | None:
    tasks = _shared_tasks(content.cells, kind) if content.cells else _published_tasks(kind)
    if len(tasks) > 1:
        tasks.pop(kind.reference, None)
    elif kind.table == "context":
        return None  # a run of the usual settings has one context
    own = {one: _own_rates(content.cells, one, kind, tasks) for one in content.names}
    own = {one: rates for one, rates in own.items() if rates}
    paper = _published_rows(kind, tasks) if published else []
    cells = _cells_of(content.cells, kind, tasks)
    differences = {key: differences_of(key, cell) for key, cell in cells.items()} if paper else {}
    rows = [
        RateRow(content.name(one) + _size_and_sign(one, cells, differences), rates)
        for one, rates in own.items()
    ]
    notes = [SIZE_NOTE, where_played([one.conditions for one in own])] if own else []
    if paper:
        episodes, seeds = TRIALS[kind.table]
        rows += [RateRow(f"published, n = {episodes} × {seeds}", {}), *paper]
        notes.append(PUBLISHED_NOTE)
        notes += [
            note
            if note.startswith((COMPARABLE_SIGN, DIFFERENT_SIGN))
            else f"{DIFFERENT_SIGN} {note}"
            for note in comparison_notes(differences, content.names)
        ]
    columns = {
        kind.title(options): f"mean over {len(names)} tasks" if len(names) > 1 else names[0]
        for options, names in tasks.items()
        if any(kind.title(options) in row.rates for row in rows)
    }
    return draw_rates(columns, rows, words, notes) if columns else None


def _cells_of(cells: Cells, kind: DrawnTable, tasks: Tasks) -> Cells:
    """Return the cells with a verdict behind the columns and their references."""
    known = {kind.reference: {task for names in tasks.values() for task in names}, **tasks}
    return {
        key: cell
        for key, cell in cells.items()
        if cell.verdicts and key.task in known.get(key.options, ())
    }


def _size_and_sign(policy_run: PolicyRun, cells: Cells, differences: AllDifferences) -> str:
    """Return how many episodes a policy has per cell, and whether its rates are comparable."""
    own = [cell.by_episode() for key, cell in cells.items() if key.policy_run == policy_run]
    sizes = sorted(map(len, own))
    text = f"n = {sizes[0]}" + (f" to {sizes[-1]}" if sizes[0] < sizes[-1] else "")
    seeds = max(len(verdicts) for episodes in own for verdicts in episodes.values())
    text += f" × {seeds}" if seeds > 1 else ""
    signs = [
        comparison_sign(one)
        for key, one in differences.items()
        if key.policy_run == policy_run and one is not None
    ]
    if signs:
        # Implicit settings have no sign in a table, which says below it that none is comparable.
        text += f" {max(signs) or DIFFERENT_SIGN}"
    return ", " + text.replace(" ", NO_BREAK)


def _shared_tasks(cells: Cells, kind: DrawnTable) -> dict[InstructionOptions, list[str]]:
    """Return by column the tasks that all policy runs with results in it played.

    Those that played the reference as well must have played these tasks with it.
    """
    played: dict[InstructionOptions, dict[PolicyRun, list[str]]] = {}
    for key, cell in cells.items():
        if cell.verdicts and PAPER_TABLES[kind.table].shows(key.options):
            played.setdefault(key.options, {}).setdefault(key.policy_run, []).append(key.task)
    shared = {}
    for options in sorted(played, key=lambda one: (setting_sort_key(one.setting), len(one.stages))):
        runs = played[options]
        references = played.get(kind.reference, {})
        needed = [*runs.values(), *(references[one] for one in runs if one in references)]
        if tasks := [task for task in needed[0] if all(task in own for own in needed)]:
            shared[options] = tasks
    return shared


def _published_tasks(kind: DrawnTable) -> dict[InstructionOptions, list[str]]:
    """Return by column the tasks that have published rates."""
    return {
        row.options: [task for task, rate in row.rates.items() if rate is not None]
        for row in published_rows(kind.table)
    }


def _own_rates(
    cells: Cells, policy_run: PolicyRun, kind: DrawnTable, tasks: Tasks
) -> dict[str, Rate]:
    """Return the rates of a policy run by column."""

    def played(options: InstructionOptions, names: Sequence[str]) -> ByTask:
        keys = [CellKey(policy_run, task, options) for task in names]
        return {key.task: cells[key] for key in keys if key in cells and cells[key].verdicts}

    groups = {(options,): played(options, names) for options, names in tasks.items()}
    found = measure_groups(
        {key: own for key, own in groups.items() if len(own) == len(tasks[key[0]])},
        [lambda key: {} if key[0] == kind.reference else played(kind.reference, tasks[key[0]])],
        is_mean=lambda _key: True,
    )
    rates = {}
    for one in found:
        rate, gap = float(one.rate or 0), one.gap
        rates[kind.title(one.key[0])] = (
            Rate(rate, None, one.interval)
            if gap is None
            else Rate(rate, rate - gap.value, gap.interval)
        )
    return rates


def _published_rows(kind: DrawnTable, tasks: Tasks) -> list[RateRow]:
    """Return a row for each published policy, that with the best reference first."""
    published = {(row.model, row.options): row for row in published_rows(kind.table)}
    references = [row for row in published.values() if row.options == kind.reference]
    rows = []
    for reference in sorted(references, key=lambda row: -row.average):
        rates = {}
        for options, names in tasks.items():
            row = published.get((reference.model, options))
            before, rate = reference.average_over(names), row and row.average_over(names)
            if before is not None and rate is not None:
                rates[kind.title(options)] = Rate(
                    float(rate) / 100,
                    float(before) / 100 if options != kind.reference else None,
                )
        if rates:
            rows.append(RateRow(reference.model, rates))
    return rows
