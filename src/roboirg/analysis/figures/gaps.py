"""Figures: success in each implicit setting, and with each longer context, next to a reference.

The reference is explicit instructions, or the shortest context. In a panel, all policies are
compared on the tasks that all of them played; published ones stand apart, below a line.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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
from roboirg.analysis.measures.measure import mean_rate, pair
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.published import TRIALS, PublishedRow, RateTable, published_rows
from roboirg.analysis.results.frame import RunNames
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.analysis.results.run_cells import CellKey, Cells
from roboirg.analysis.tables.table_kinds import PAPER_TABLES, row_order, stages_text
from roboirg.analysis.tables.table_notes import where_played
from roboirg.core.instruction_options import InstructionOptions, options_label
from roboirg.stats.cells import NOTHING, ByTask, Cell, rate_interval
from roboirg.stats.paired_tests import measure_gap

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NO_BREAK = "\N{NO-BREAK SPACE}"
SIZE_NOTE = (
    "n: episodes per task and setting, × policy seeds if there are several; where no band is "
    "drawn, too few episodes."
)
PUBLISHED_NOTE = "published: the same tasks, the paper's instructions and simulator."
WORDS = {
    "main": RateWords("success with explicit instructions", "with implicit ones"),
    "context": RateWords("success with stages 1,5", "with more stages"),
}

Tasks = Mapping[InstructionOptions, Sequence[str]]
"""The tasks of each column."""
Played = Mapping[InstructionOptions, Mapping[PolicyRun, ByTask]]
"""By column and policy run, the tasks with a verdict."""


def draw_next_to_reference(which: RateTable, content: RunData, published: bool) -> Figure | None:
    """Draw success in each setting next to success in a reference setting, on the same tasks.

    Args:
        which: ``main`` compares settings with explicit instructions, which name the goal;
            ``context`` compares long contexts with the shortest one.
        content: of the runs.
        published: whether to add the paper's rates, in gray.

    Returns:
        The figure. None without data, and for contexts if there is only one, as in a run of the
        usual settings.
    """
    columns = _Columns(which, _compared_tasks(which, content.cells))
    gray_rows = columns.rows_of_paper() if published else []
    cells = columns.cells_behind(content.cells)
    differences = {}
    if gray_rows:
        differences = {key: differences_of(key, cell) for key, cell in cells.items()}

    own_rates = columns.own_rates(content)
    rows = []
    for policy_run, rates in own_rates.items():
        label = content.name(policy_run) + _size_and_sign(policy_run, cells, differences)
        rows.append(RateRow(label, rates))
    notes = []
    if rows:
        notes += [SIZE_NOTE, where_played(own_rates)]
    if gray_rows:
        rows += gray_rows
        notes.append(PUBLISHED_NOTE)
        notes += _signed_notes(differences, content.frame.names)
    titles = columns.titles(rows)
    if not titles:
        return None
    return draw_rates(titles, rows, WORDS[which], notes)


@dataclass(frozen=True)
class _Columns:
    """The columns of a figure.

    Attributes:
        which: the table of the paper whose rates are drawn.
        tasks: over which the rates of each column are, and the references next to them.
    """

    which: RateTable
    tasks: Tasks

    @property
    def reference(self) -> InstructionOptions:
        """The options of the rates that others are compared with."""
        return PAPER_TABLES[self.which].reference()

    def title(self, options: InstructionOptions) -> str:
        if self.which == "main":
            return options_label(options)
        return f"stages {stages_text(options)}"

    def titles(self, rows: Sequence[RateRow]) -> dict[str, str]:
        """Return the titles of the columns in which some row has a rate, and what each is over.

        For example ``{"temporal": "mean over 4 tasks", "ordinal": "PickXtimes"}``.
        """
        titles = {}
        for options, names in self.tasks.items():
            title = self.title(options)
            if any(title in row.rates for row in rows):
                titles[title] = names[0] if len(names) == 1 else f"mean over {len(names)} tasks"
        return titles

    def cells_behind(self, cells: Cells) -> dict[CellKey, Cell]:
        """Return the cells whose trials are drawn in some column, as a rate or as its reference.

        The reference is drawn in each column, over the column's tasks. Cells without a verdict are
        left out.
        """
        drawn = set()
        for options, names in self.tasks.items():
            for task in names:
                drawn.add((options, task))
                drawn.add((self.reference, task))
        behind = {}
        for key, cell in cells.items():
            if cell.verdicts and (key.options, key.task) in drawn:
                behind[key] = cell
        return behind

    def own_rates(self, content: RunData) -> dict[PolicyRun, dict[str, Rate]]:
        """Return for each policy run its rates by the title of the column, over the column's tasks.

        Columns, and policy runs, without results are left out.
        """
        played = _played(self.which, content.cells)
        rates_of_runs = {}
        for policy_run in content.frame.names:
            at_reference = played.get(self.reference, {}).get(policy_run, NOTHING)
            rates = {}
            for options, names in self.tasks.items():
                by_task = played.get(options, {}).get(policy_run)
                if by_task is not None:
                    cells = {task: by_task[task] for task in names}
                    # The reference is not compared with itself.
                    others = NOTHING if options == self.reference else at_reference
                    rate = _rate(cells, others)
                    if policy_run.is_until_decided:
                        rate = rate._replace(interval=None)
                    rates[self.title(options)] = rate
            if rates:
                rates_of_runs[policy_run] = rates
        return rates_of_runs

    def rows_of_paper(self) -> list[RateRow]:
        """Return the rows of published models below a heading, that with the best reference first.

        A model's rates are over the tasks of the columns, where the paper has a rate for each of
        these. Without any rate there is no heading.
        """
        published = {(row.model, row.options): row for row in published_rows(self.which)}
        references = [row for row in published.values() if row.options == self.reference]
        rows = []
        for reference in sorted(references, key=lambda row: -row.average):
            rates = {}
            for options, names in self.tasks.items():
                row = published.get((reference.model, options))
                rate = None if row is None else _published_rate(row, reference, names)
                if rate is not None:
                    rates[self.title(options)] = rate
            if rates:
                rows.append(RateRow(reference.model, rates))
        if not rows:
            return []
        trials = TRIALS[self.which]
        return [RateRow(f"published, n = {trials.episodes} × {trials.seeds}", {}), *rows]


def _signed_notes(differences: AllDifferences, names: RunNames) -> list[str]:
    """Return sentences on which rates can be compared with published ones: after ``=`` or ``≠``."""
    notes = []
    for note in comparison_notes(differences, names):
        has_sign = note.startswith((COMPARABLE_SIGN, DIFFERENT_SIGN))
        notes.append(note if has_sign else f"{DIFFERENT_SIGN} {note}")
    return notes


def _compared_tasks(which: RateTable, cells: Cells) -> Tasks:
    """Return the columns of the figure, one for each set of options, with the tasks of each.

    For example ``{options of temporal: ["BinFill", "StopCube"]}``: two tasks in a column.

    The reference, such as explicit, is drawn in every column and has none of its own unless it is
    alone. Without results the columns are the paper's. Contexts need several, else there are none.
    """
    tasks = _published_tasks(which)
    if cells:
        tasks = _shared_tasks(which, _played(which, cells))
    if len(tasks) > 1:
        tasks.pop(PAPER_TABLES[which].reference(), None)
    elif which == "context":
        return {}
    return tasks


def _played(which: RateTable, cells: Cells) -> Played:
    """Select the cells that the figure may show; return them by options, policy run and task.

    A cell, the trials of a task, must have a verdict, and the table must have rows for its options.
    """
    found: dict[InstructionOptions, dict[PolicyRun, dict[str, Cell]]] = {}
    for (policy_run, task, options), cell in cells.items():
        if cell.verdicts and PAPER_TABLES[which].shows(options):
            found.setdefault(options, {}).setdefault(policy_run, {})[task] = cell
    return found


def _shared_tasks(which: RateTable, played: Played) -> dict[InstructionOptions, list[str]]:
    """Return for each set of options the tasks that all policy runs with results for it played.

    Policy runs that played the reference, such as explicit, must have played the tasks there, too.
    So all rates of a column, and their references, are over the same tasks.

    Args:
        which: the table that the figure draws.
        played: cells by options, policy run and task.
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


def _rate(cells: ByTask, others: ByTask) -> Rate:
    """Return a success rate to draw, 0 to 1, and its reference's on the same episodes if known.

    Args:
        cells: the trials by task.
        others: those of the reference; none if there is none.
    """
    rate = float(mean_rate(cells) or 0)
    gap = measure_gap(pair(cells, others))
    if gap is None:
        return Rate(rate, interval=rate_interval(cells.values()))
    # The reference follows from the gap; the interval is then that of the gap.
    return Rate(rate, rate - gap.value, gap.interval)


def _size_and_sign(policy_run: PolicyRun, cells: Cells, differences: AllDifferences) -> str:
    """Return the end of a policy's label: how many episodes it played, and if it is comparable.

    For example ``, n = 10 to 50 × 3 =``: 10 to 50 episodes of a task in a setting, with 3 policy
    seeds, and rates that can be compared with published ones.

    Args:
        policy_run: whose label it is.
        cells: the trials behind the figure.
        differences: of cells from published rates; empty if these are not drawn.
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


def _published_rate(
    row: PublishedRow, reference: PublishedRow, tasks: Sequence[str]
) -> Rate | None:
    """Return a published success rate over some tasks, 0 to 1, next to that of its reference.

    None if either lacks the rate of a task.

    Args:
        row: a model's rates in one setting, in percent.
        reference: the model's rates in the reference setting; if it is the same row, the rate
            stands alone.
        tasks: over which rates are averaged.
    """
    percent = row.average_over(tasks)
    reference_percent = reference.average_over(tasks)
    if percent is None or reference_percent is None:
        return None
    if row is reference:
        return Rate(float(percent) / 100)
    return Rate(float(percent) / 100, float(reference_percent) / 100)
