"""Which rows and columns each table of rates has."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from roboirg.core.instruction_options import ALL_STAGES, InstructionOptions
from roboirg.evaluation.analysis.published import AVERAGE, RateTable, published_tasks
from roboirg.evaluation.analysis.results.frame import RunNames
from roboirg.evaluation.analysis.results.option_labels import (
    has_default_options,
    is_usual,
    reference_of,
    setting_sort_key,
    staged_options,
)
from roboirg.evaluation.analysis.results.policy_run import PolicyRun
from roboirg.evaluation.analysis.stats.cells import Cells
from roboirg.evaluation.analysis.tables.table import POLICY, Column, Entry, Row
from roboirg.tasks import all_tasks, every_task

Shows = Callable[[InstructionOptions], bool]

TWIN_MARK = " (twin)"
"""After policies that played the simulated twin of a real robot's task."""


def row_order(options: InstructionOptions) -> tuple[object, ...]:
    stages = options.stages
    language = options.language
    return (*setting_sort_key(options.setting), len(stages), stages, language)


def stages_text(options: InstructionOptions) -> str:
    return ",".join(map(str, options.stages))


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
    reference: Callable[[InstructionOptions], InstructionOptions] = reference_of
    heads: tuple[str, ...] = ("setting", POLICY)
    by_suite: bool = False

    @property
    def is_by_stages(self) -> bool:
        """Whether the rows of a group are sets of stages, and the groups policies."""
        return len(self.heads) > 2  # noqa: PLR2004 - a column for each stage

    def tasks(self, cells: Cells) -> tuple[str, ...]:
        """Return the paper's tasks, or all others that were played."""
        if self.of_paper is not None:
            return published_tasks(self.of_paper)
        known = {*published_tasks("main"), *published_tasks("real")}
        played = {key.task for key in cells} - known
        return tuple(sorted(played, key=lambda task: (task not in every_task(), task)))

    def columns(self, tasks: Sequence[str]) -> tuple[Column, ...]:
        """Return the tasks, by suite with its average; the overall average comes last."""
        columns = list(map(Column, tasks))
        if self.by_suite:
            suites: dict[str, list[str]] = {}
            for task in tasks:
                suites.setdefault(all_tasks()[task].suite.capitalize(), []).append(task)
            columns = []
            for suite, own in suites.items():
                columns += [Column(name, suite) for name in own]
                columns.append(Column(f"{suite} {AVERAGE}", suite, tuple(own)))
        return (*columns, Column(AVERAGE, averages=tuple(tasks)))

    def positions(
        self, cells: Cells, names: RunNames
    ) -> Iterator[tuple[PolicyRun, InstructionOptions, str]]:
        """Yield policy run, options and label of the policy of each row."""
        tasks = set(self.tasks(cells))
        played = {(key.policy_run, key.options) for key in cells if key.task in tasks}
        shown = sorted({options for _, options in played if self.shows(options)}, key=row_order)
        for policy_run, label in names.items():
            is_twin = self.of_paper == "real" and policy_run.robot is None
            for options in shown:
                if (policy_run, options) in played:
                    yield policy_run, options, label + TWIN_MARK * is_twin

    def row(self, options: InstructionOptions, policy: str, cells: Sequence[Entry]) -> Row:
        if self.is_by_stages:
            return Row(policy, stages_text(options), cells)
        return Row(options.setting, policy, cells)


PAPER_TABLES: Mapping[str, PaperTable] = {
    one.name: one
    for one in (
        PaperTable("main", "Success by task and setting", "main", by_suite=True),
        PaperTable("planner", "High-level planners", "planner", heads=(POLICY, "setting")),
        PaperTable(
            "context",
            "Stages of the contextual setting",
            "context",
            shows=lambda options: options in staged_options(options.language),
            reference=lambda options: staged_options(options.language)[0],
            heads=(POLICY, *map(str, ALL_STAGES)),
        ),
        PaperTable("real", "Real world", "real"),
        PaperTable(
            "harder",
            "Harder settings",
            "main",
            shows=lambda options: (
                options == reference_of(options)
                or (is_usual(options) and not has_default_options(options))
            ),
            by_suite=True,
        ),
        PaperTable("other", "Tasks outside the paper", None),
    )
}
