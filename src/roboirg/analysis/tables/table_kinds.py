"""Which rows and columns each table of rates has."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from roboirg.analysis.comparability import AllDifferences
from roboirg.analysis.published import AVERAGE, RateTable, published_tasks
from roboirg.analysis.results.frame import RunNames
from roboirg.analysis.results.option_labels import (
    REFERENCE_OPTIONS,
    SortKey,
    has_default_options,
    is_usual,
    setting_sort_key,
    staged_options,
)
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.analysis.results.run_cells import Cells
from roboirg.analysis.tables.table import POLICY, Column, Entry, Row, Source
from roboirg.core.instruction_options import ALL_STAGES, InstructionOptions
from roboirg.tasks import all_tasks, every_task

Shows = Callable[[InstructionOptions], bool]

TWIN_MARK = " (twin)"
"""After policies that played the simulated twin of a real robot's task."""


def row_order(options: InstructionOptions) -> SortKey:
    """Return a key that sorts rows by setting, and within it those with fewer stages first."""
    stages = options.stages
    return (*setting_sort_key(options.setting), len(stages), stages)


def stages_text(options: InstructionOptions) -> str:
    """Return the stages of options, such as ``1,5``."""
    return ",".join(map(str, options.stages))


class TableResults(NamedTuple):
    """The results behind a table of rates.

    Attributes:
        tasks: of the table.
        played: the cells of all tasks and options.
        shown: those of them that the table shows.
        names: labels of the policy runs, in the order of their rows.
        differences: of the shown cells from published rates; empty if these are not shown.
    """

    tasks: Sequence[str]
    played: Cells
    shown: Cells
    names: RunNames
    differences: AllDifferences


@dataclass(frozen=True)
class PaperTable:
    """What a table of rates has columns and rows for.

    Attributes:
        name: as in the command line.
        title: above it.
        of_paper: the table of the paper with its tasks; None for all other tasks.
        shows: whether it has rows for instruction options.
        reference: returns the options that changes are from.
        heads: of the groups of rows and of their names.
        by_suite: whether its columns are grouped by suite, each with an average.
    """

    name: str
    title: str
    of_paper: RateTable | None
    shows: Shows = has_default_options
    reference: Callable[[], InstructionOptions] = lambda: REFERENCE_OPTIONS
    heads: tuple[str, ...] = ("setting", POLICY)
    by_suite: bool = False

    @property
    def is_by_stages(self) -> bool:
        """Whether the rows of a group are sets of stages, and the groups policies."""
        return len(self.heads) > 2  # noqa: PLR2004 - a column for each stage

    def tasks(self, cells: Cells) -> tuple[str, ...]:
        """Return the tasks of the table: those of the paper's, or all that are in none of these.

        Of the latter, tasks that were played but are not installed here come last.
        """
        if self.of_paper is not None:
            return published_tasks(self.of_paper)
        in_paper = {*published_tasks("main"), *published_tasks("real")}
        others = {key.task for key in cells} - in_paper
        return tuple(sorted(others, key=lambda task: (task not in every_task(), task)))

    def columns(self, tasks: Sequence[str]) -> tuple[Column, ...]:
        """Return a column for each task, and the average over all last.

        If the table is by suite, the tasks of a suite stand together, with their average behind.
        """
        overall = Column(AVERAGE, averages=tuple(tasks))
        if not self.by_suite:
            return (*map(Column, tasks), overall)
        suites = defaultdict(list)
        for task in tasks:
            suite = all_tasks()[task].suite.capitalize()
            suites[suite].append(task)
        columns = []
        for suite, tasks_of_suite in suites.items():
            for task in tasks_of_suite:
                columns.append(Column(task, suite))
            columns.append(Column(f"{suite} {AVERAGE}", suite, tuple(tasks_of_suite)))
        return (*columns, overall)

    def shown(self, cells: Cells) -> Cells:
        """Select the cells that the table shows: of its tasks, and of options with a row."""
        tasks = self.tasks(cells)
        shown = {}
        for key, cell in cells.items():
            if key.task in tasks and self.shows(key.options):
                shown[key] = cell
        return shown

    def label(self, policy_run: PolicyRun, name: str) -> str:
        """Return the name of a policy run in the table; a real robot's twin is marked."""
        if self.of_paper == "real" and policy_run.robot is None:
            return name + TWIN_MARK
        return name

    def row(self, options: InstructionOptions, policy: str, cells: Sequence[Entry]) -> Row:
        """Return a row with its labels."""
        if self.is_by_stages:
            return Row(policy, stages_text(options), cells)
        return Row(options.setting, policy, cells)

    def reference_position(self, row: Row) -> tuple[str, str, Source]:
        """Return the position of the row with the same policy and the reference's options."""
        if self.is_by_stages:
            return row.group, stages_text(self.reference()), row.source
        return self.reference().setting, row.name, row.source


PAPER_TABLES: Mapping[str, PaperTable] = {
    table.name: table
    for table in (
        PaperTable("main", "Success by task and setting", "main", by_suite=True),
        PaperTable("planner", "High-level planners", "planner", heads=(POLICY, "setting")),
        PaperTable(
            "context",
            "Stages of the contextual setting",
            "context",
            shows=lambda options: options in staged_options(),
            reference=lambda: staged_options()[0],
            heads=(POLICY, *map(str, ALL_STAGES)),
        ),
        PaperTable("real", "Real world", "real"),
        PaperTable(
            "harder",
            "Harder settings",
            "main",
            shows=lambda options: (
                options == REFERENCE_OPTIONS
                or (is_usual(options) and not has_default_options(options))
            ),
            by_suite=True,
        ),
        PaperTable("other", "Tasks outside the paper", None),
    )
}
