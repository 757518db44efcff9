"""Figures: success in each implicit setting, and with each longer context, next to a reference.

The reference is explicit instructions, or the shortest context. In a panel, all policies are
compared on the tasks that all of them played; published ones stand apart, below a line.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

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
from roboirg.evaluation.analysis.results.option_labels import options_label
from roboirg.evaluation.analysis.results.policy_run import PolicyRun
from roboirg.evaluation.analysis.stats.cells import NOTHING, ByTask, Cell, Cells
from roboirg.evaluation.analysis.stats.measure import measure_groups
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.table_kinds import PAPER_TABLES, row_order, stages_text
from roboirg.evaluation.analysis.tables.table_notes import where_played

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NO_BREAK = "\N{NO-BREAK SPACE}"
SIZE_NOTE = (
    "n: episodes per task and setting, × policy seeds if there are several; where no band is "
    "drawn, too few episodes."
)
PUBLISHED_NOTE = "published: the same tasks, the paper's instructions and simulator."
WORDS = {
    "main": ("success", "success with explicit instructions", "with implicit ones"),
    "context": ("success", "success with stages 1,5", "with more stages"),
}
"""What the legend calls a rate that stands alone, the reference, and a rate next to it."""

Tasks = Mapping[InstructionOptions, Sequence[str]]
"""The tasks of each column."""
Played = Mapping[InstructionOptions, Mapping[PolicyRun, ByTask]]
"""By column and policy run, the tasks with a verdict."""


def draw_next_to_reference(which: RateTable, content: RunData, published: bool) -> Figure | None:
    """Draw the rates of the table ``main`` or ``context``; alone those without a reference.

    None without data, and for contexts if there is only one, as in a run of the usual settings.
    """
    table = PAPER_TABLES[which]
    played = _played(which, content.cells)
    tasks = _shared_tasks(which, played) if content.cells else _published_tasks(which)
    if which == "context" and len(tasks) <= 1:
        return None
    tasks = {one: names for one, names in tasks.items() if one != table.reference(one)} or tasks
    shown = {task for names in tasks.values() for task in names}
    every = {table.reference(one): shown for one in tasks} | tasks
    cells = {
        key: cell
        for key, cell in content.cells.items()
        if cell.verdicts and key.task in every.get(key.options, ())
    }
    own = {one: _own_rates(which, one, played, tasks) for one in content.frame.names}
    own = {one: rates for one, rates in own.items() if rates}
    paper = list(_published_rates(which, tasks)) if published else []
    differences = {key: differences_of(key, cell) for key, cell in cells.items() if paper}
    rows = [
        RateRow(content.name(one) + _size_and_sign(one, cells, differences), rates)
        for one, rates in own.items()
    ]
    notes = [SIZE_NOTE, where_played([one.conditions for one in own])] if own else []
    if paper:
        episodes, seeds = TRIALS[which]
        rows += [RateRow(f"published, n = {episodes} × {seeds}", {}), *paper]
        signs = (COMPARABLE_SIGN, DIFFERENT_SIGN)
        found = comparison_notes(differences, content.frame.names)
        signed = (one if one.startswith(signs) else f"{DIFFERENT_SIGN} {one}" for one in found)
        notes += [PUBLISHED_NOTE, *signed]
    columns = {
        _title(which, options): f"mean over {len(names)} tasks" if len(names) > 1 else names[0]
        for options, names in tasks.items()
        if any(_title(which, options) in row.rates for row in rows)
    }
    return draw_rates(columns, rows, WORDS[which], notes) if columns else None


def _title(which: RateTable, options: InstructionOptions) -> str:
    return options_label(options) if which == "main" else f"stages {stages_text(options)}"


def _played(which: RateTable, cells: Cells) -> Played:
    found: dict[InstructionOptions, dict[PolicyRun, dict[str, Cell]]] = {}
    for (policy_run, task, options), cell in cells.items():
        if cell.verdicts and PAPER_TABLES[which].shows(options):
            found.setdefault(options, {}).setdefault(policy_run, {})[task] = cell
    return found


def _shared_tasks(which: RateTable, played: Played) -> dict[InstructionOptions, list[str]]:
    """Return by column the tasks that all policy runs with results in it played.

    Those that played the reference as well must have played these tasks with it.
    """
    shared = {}
    for options in sorted(played, key=row_order):
        runs = played[options]
        before = played.get(PAPER_TABLES[which].reference(options), {})
        needed = [*runs.values(), *(own for run, own in before.items() if run in runs)]
        if tasks := [task for task in needed[0] if all(task in own for own in needed)]:
            shared[options] = tasks
    return shared


def _published_tasks(which: RateTable) -> dict[InstructionOptions, list[str]]:
    """Return by column the tasks that have published rates."""
    return {
        row.options: [task for task, rate in row.rates.items() if rate is not None]
        for row in published_rows(which)
    }


def _own_rates(
    which: RateTable, policy_run: PolicyRun, played: Played, tasks: Tasks
) -> dict[str, Rate]:
    """Return the rates of a policy run by column, over exactly the column's tasks."""
    own = {options: runs[policy_run] for options, runs in played.items() if policy_run in runs}

    def reference(key: tuple[InstructionOptions]) -> ByTask:
        before = PAPER_TABLES[which].reference(key[0])
        return NOTHING if key[0] == before else own.get(before, NOTHING)

    found = measure_groups(
        {
            (options,): {task: own[options][task] for task in names}
            for options, names in tasks.items()
            if options in own
        },
        [reference],
        is_mean=lambda _key: True,
    )
    rates = {}
    for one in found:
        rate = float(one.rate or 0)
        gap = one.gap
        before = None if gap is None else rate - gap.value
        rates[_title(which, one.key[0])] = Rate(rate, before, (gap or one).interval)
    return rates


def _size_and_sign(policy_run: PolicyRun, cells: Cells, differences: AllDifferences) -> str:
    """Return how many episodes a policy has per cell, and whether its rates are comparable."""
    trials = [cell.rows()[:, 1] for key, cell in cells.items() if key.policy_run == policy_run]
    sizes = sorted({len(one) for one in trials})
    seeds = max(max(one) for one in trials)
    text = f"n = {sizes[0]}"
    if len(sizes) > 1:
        text += f" to {sizes[-1]}"
    if seeds > 1:
        text += f" × {seeds}"
    own = [one for key, one in differences.items() if key.policy_run == policy_run]
    signs = [comparison_sign(one) for one in own if one is not None]
    if signs:
        # Implicit settings have no sign in a table, which says below it that none is comparable.
        text += f" {max(signs) or DIFFERENT_SIGN}"
    return ", " + text.replace(" ", NO_BREAK)


def _published_rates(which: RateTable, tasks: Tasks) -> Iterator[RateRow]:
    """Yield a row for each published policy, that with the best reference first."""
    reference = PAPER_TABLES[which].reference
    published = {(row.model, row.options): row for row in published_rows(which)}
    references = [row for row in published.values() if row.options == reference(row.options)]
    for first in sorted(references, key=lambda row: -row.average):
        rates = {}
        for options, names in tasks.items():
            row = published.get((first.model, options), first)
            rate = row.average_over(names)
            before = first.average_over(names)
            if rate is not None and before is not None and row.options == options:
                alone = float(rate) / 100
                rates[_title(which, options)] = Rate(
                    alone, None if row is first else float(before) / 100
                )
        if rates:
            yield RateRow(first.model, rates)
