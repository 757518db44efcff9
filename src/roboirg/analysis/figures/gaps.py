"""Figures: success in each implicit setting, and with each longer context, next to a reference.

The reference is explicit instructions, or the shortest context. In a panel, all policies are
compared on the tasks that all of them played; published ones stand apart, below a line.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from roboirg.analysis.comparability import (
    COMPARABLE_SIGN,
    DIFFERENT_SIGN,
    AllDifferences,
    comparison_notes,
    comparison_sign,
    differences_of,
)
from roboirg.analysis.figures.rates import Rate, RateRow, RateWords, draw_rates
from roboirg.analysis.measures.measure import Measured, measure_groups
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.published import TRIALS, RateTable, published_rows
from roboirg.analysis.results.frame import RunNames
from roboirg.analysis.results.option_labels import options_label
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.analysis.results.run_cells import CellKey, Cells
from roboirg.analysis.tables.table_kinds import PAPER_TABLES, row_order, stages_text
from roboirg.analysis.tables.table_notes import where_played
from roboirg.core.instruction_options import InstructionOptions
from roboirg.stats.cells import NOTHING, ByTask, Cell

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NO_BREAK = "\N{NO-BREAK SPACE}"
SIZE_NOTE = (
    "n: episodes per task and setting, × policy seeds if there are several; where no band is "
    "drawn, too few episodes."
)
PUBLISHED_NOTE = "published: the same tasks, the paper's instructions and simulator."
WORDS = {
    "main": RateWords("success", "success with explicit instructions", "with implicit ones"),
    "context": RateWords("success", "success with stages 1,5", "with more stages"),
}

Tasks = Mapping[InstructionOptions, Sequence[str]]
"""The tasks of each column."""
Played = Mapping[InstructionOptions, Mapping[PolicyRun, ByTask]]
"""By column and policy run, the tasks with a verdict."""


def draw_next_to_reference(which: RateTable, content: RunData, published: bool) -> Figure | None:
    """Draw the rates of a table, each next to the reference's on the same tasks.

    Args:
        which: ``main``, whose reference is explicit, or ``context``, whose is the shortest one.
        content: of the runs.
        published: whether to add the paper's rates, in gray.

    Returns:
        The figure. None without data, and for contexts if there is only one, as in a run of the
        usual settings.
    """
    played = _played(which, content.cells)
    tasks: Tasks = _published_tasks(which)  # without results, only the paper's rates are drawn
    if content.cells:
        tasks = _shared_tasks(which, played)
    if which == "context" and len(tasks) <= 1:
        return None
    tasks = _without_reference(which, tasks)

    gray_rows = list(_published_rate_rows(which, tasks)) if published else []
    cells = _cells_behind(which, tasks, content.cells)
    differences = {}
    if gray_rows:
        differences = {key: differences_of(key, cell) for key, cell in cells.items()}

    rows = []
    notes = []
    drawn_runs = []
    for policy_run in content.frame.names:
        rates = _own_rates(which, policy_run, played, tasks)
        if rates:
            drawn_runs.append(policy_run)
            label = content.name(policy_run) + _size_and_sign(policy_run, cells, differences)
            rows.append(RateRow(label, rates))
    if rows:
        notes += [SIZE_NOTE, where_played(drawn_runs)]
    if gray_rows:
        trials = TRIALS[which]
        rows.append(RateRow(f"published, n = {trials.episodes} × {trials.seeds}", {}))
        rows += gray_rows
        notes.append(PUBLISHED_NOTE)
        notes += _signed_notes(differences, content.frame.names)
    columns = _columns(which, tasks, rows)
    if not columns:
        return None
    return draw_rates(columns, rows, WORDS[which], notes)


def _columns(which: RateTable, tasks: Tasks, rows: Sequence[RateRow]) -> dict[str, str]:
    """Return the titles of the columns in which some row has a rate, and what each is over.

    For example ``{"temporal": "mean over 4 tasks", "ordinal": "PickXtimes"}``.
    """
    columns = {}
    for options, names in tasks.items():
        title = _title(which, options)
        if any(title in row.rates for row in rows):
            columns[title] = names[0] if len(names) == 1 else f"mean over {len(names)} tasks"
    return columns


def _signed_notes(differences: AllDifferences, names: RunNames) -> list[str]:
    """Return what makes rates comparable or not, each sentence after its sign."""
    notes = []
    for note in comparison_notes(differences, names):
        has_sign = note.startswith((COMPARABLE_SIGN, DIFFERENT_SIGN))
        notes.append(note if has_sign else f"{DIFFERENT_SIGN} {note}")
    return notes


def _title(which: RateTable, options: InstructionOptions) -> str:
    """Return the title of a column."""
    if which == "main":
        return options_label(options)
    return f"stages {stages_text(options)}"


def _played(which: RateTable, cells: Cells) -> Played:
    """Return the cells with a verdict that the figure may show, by options, run and task."""
    found: dict[InstructionOptions, dict[PolicyRun, dict[str, Cell]]] = {}
    for (policy_run, task, options), cell in cells.items():
        if cell.verdicts and PAPER_TABLES[which].shows(options):
            found.setdefault(options, {}).setdefault(policy_run, {})[task] = cell
    return found


def _shared_tasks(which: RateTable, played: Played) -> dict[InstructionOptions, list[str]]:
    """Return by column the tasks that all policy runs with results in it played.

    Those that played the reference as well must have played these tasks with it, so all rates of a
    column, and all references, are over the same tasks.
    """
    at_reference = played.get(PAPER_TABLES[which].reference(), {})
    shared = {}
    for options in sorted(played, key=row_order):
        runs = played[options]
        first, *others = runs.values()
        for policy_run, by_task in at_reference.items():
            if policy_run in runs:
                others.append(by_task)
        tasks = list(first)
        for other in others:
            tasks = [task for task in tasks if task in other]
        if tasks:
            shared[options] = tasks
    return shared


def _published_tasks(which: RateTable) -> dict[InstructionOptions, list[str]]:
    """Return by column the tasks that have published rates."""
    tasks = {}
    for row in published_rows(which):
        tasks[row.options] = [task for task, rate in row.rates.items() if rate is not None]
    return tasks


def _without_reference(which: RateTable, tasks: Tasks) -> Tasks:
    """Return the columns other than the reference; the reference only if there is nothing else."""
    others = dict(tasks)
    others.pop(PAPER_TABLES[which].reference(), None)
    return others or tasks


def _cells_behind(which: RateTable, tasks: Tasks, cells: Cells) -> dict[CellKey, Cell]:
    """Return the cells with a verdict behind the columns, and behind the reference next to them.

    The reference has the tasks of all columns.
    """
    drawn: set[tuple[InstructionOptions, str]] = set()
    for options, names in tasks.items():
        for task in names:
            drawn.add((options, task))
            drawn.add((PAPER_TABLES[which].reference(), task))
    behind = {}
    for key, cell in cells.items():
        if cell.verdicts and (key.options, key.task) in drawn:
            behind[key] = cell
    return behind


def _own_rates(
    which: RateTable, policy_run: PolicyRun, played: Played, tasks: Tasks
) -> dict[str, Rate]:
    """Return the rates of a policy run by column, over exactly the column's tasks.

    A column is left out if the policy run has no results in it.
    """
    reference_options = PAPER_TABLES[which].reference()
    groups = {}
    for options, names in tasks.items():
        by_task = played.get(options, {}).get(policy_run)
        if by_task is not None:
            groups[(options,)] = {task: by_task[task] for task in names}

    def reference(key: tuple[InstructionOptions]) -> ByTask:
        if key == (reference_options,):
            return NOTHING  # it is not compared with itself
        return played.get(reference_options, {}).get(policy_run, NOTHING)

    rates = {}
    for measured in measure_groups(groups, reference, is_mean=lambda _key: True):
        (options,) = measured.key
        rates[_title(which, options)] = _rate(measured)
    return rates


def _rate(measured: Measured[tuple[InstructionOptions]]) -> Rate:
    """Return a rate, next to that of the reference if there is one."""
    rate = float(measured.rate or 0)
    gap = measured.gap
    if gap is None:
        return Rate(rate, interval=measured.interval)
    return Rate(rate, rate - gap.value, gap.interval)


def _size_and_sign(policy_run: PolicyRun, cells: Cells, differences: AllDifferences) -> str:
    """Return how many episodes a policy has per cell, and whether its rates are comparable.

    For example ``, n = 10 to 50 × 3 =``: up to 50 episodes with 3 seeds, comparable.
    """
    sizes = set()
    seeds = 0
    signs = []
    for key, cell in cells.items():
        if key.policy_run != policy_run:
            continue
        by_episode = cell.by_episode()
        sizes.add(len(by_episode))
        seeds = max(seeds, *map(len, by_episode.values()))
        cell_differences = differences.get(key)
        if cell_differences is not None:
            signs.append(comparison_sign(cell_differences))

    text = f"n = {min(sizes)}"
    if len(sizes) > 1:
        text += f" to {max(sizes)}"
    if seeds > 1:
        text += f" × {seeds}"
    if signs:
        # Implicit settings have no sign in a table, which says below it that none is comparable.
        is_comparable = COMPARABLE_SIGN in signs and DIFFERENT_SIGN not in signs
        text += f" {COMPARABLE_SIGN if is_comparable else DIFFERENT_SIGN}"
    return ", " + text.replace(" ", NO_BREAK)


def _published_rate_rows(which: RateTable, tasks: Tasks) -> Iterator[RateRow]:
    """Yield a row for each published policy, that with the best reference first.

    Its rates and references are over the tasks of the columns, if the paper has a rate for each.
    """
    reference_options = PAPER_TABLES[which].reference()
    published = {(row.model, row.options): row for row in published_rows(which)}
    references = [row for row in published.values() if row.options == reference_options]
    for reference in sorted(references, key=lambda row: -row.average):
        rates = {}
        for options, names in tasks.items():
            row = published.get((reference.model, options))
            if row is None:
                continue
            percent = row.average_over(names)
            reference_percent = reference.average_over(names)
            if percent is None or reference_percent is None:
                continue
            rate = Rate(float(percent) / 100)
            if row is not reference:
                rate = rate._replace(reference=float(reference_percent) / 100)
            rates[_title(which, options)] = rate
        if rates:
            yield RateRow(reference.model, rates)
