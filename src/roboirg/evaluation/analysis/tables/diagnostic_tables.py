"""Tables that the paper has no numbers for: forms, failures, and others of runs alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.stats.failure_counts import FAILURES, count_failures
from roboirg.evaluation.analysis.stats.form_gaps import form_rows
from roboirg.evaluation.analysis.stats.option_labels import options_label, options_sort_key
from roboirg.evaluation.analysis.stats.paired_tests import Gap, holm
from roboirg.evaluation.analysis.stats.rates import points
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.stats.run_summary import ALL_TASKS
from roboirg.evaluation.analysis.tables.arm_table import make_arm_table
from roboirg.evaluation.analysis.tables.breakdown_table import (
    corrected_p_text,
    interval_text,
)
from roboirg.evaluation.analysis.tables.facts_table import make_facts_table
from roboirg.evaluation.analysis.tables.heard_table import make_heard_table
from roboirg.evaluation.analysis.tables.subgoal_table import make_subgoal_table
from roboirg.evaluation.analysis.tables.table import POLICY, Column, Row, Table
from roboirg.evaluation.records.record import Record
from roboirg.judging.failure_attribution import EXECUTION, GROUNDING

FORM_COLUMNS = tuple(
    map(Column, ("trials", "both", "only resolved", "only implicit", "neither"))
) + tuple(map(Column, ("implicit − resolved", "95 % interval", "p")))
_FORMS_NOTE = (
    "The same episodes in the implicit form and in the resolved one, which names the goal: trials "
    "solved in both, in one alone, in neither. The difference, the mean over tasks, and its "
    "interval are in points; p-values are corrected over all rows of the policy."
)
_FAILURES_NOTE = (
    "Failed episodes, and how many of them failed in each way, with their share of the failures. "
    "Grounding: the policy did something else than the instruction means; execution: it did not "
    "complete what the instruction means."
)


def make_forms_table(data: RunData) -> Table:
    """Make the table of implicit against resolved forms, as numbers of the figure.

    Raises:
        InvalidValueError: no episode was played in both forms.
    """
    rows: list[Row] = []
    for policy_run, name in data.names.items():
        found = form_rows(data, policy_run)
        corrected = holm([row.gap.p_value for row in found])
        rows += [
            Row(f"{name}, {row.scope}", row.setting, _form_words(row.gap, p_value))
            for row, p_value in zip(found, corrected, strict=True)
        ]
    if not rows:
        raise InvalidValueError(
            "The runs have no episode in both forms; play them with --forms implicit,resolved."
        )
    return Table(
        key="forms",
        title="Implicit and resolved form",
        heads=(POLICY, "setting"),
        columns=FORM_COLUMNS,
        rows=tuple(rows),
        notes=(_FORMS_NOTE,),
    )


def _form_words(gap: Gap, p_value: float) -> tuple[str, ...]:
    overlap = gap.overlap
    counts = (overlap.trials, overlap.both, overlap.only_second, overlap.only_first)
    words = (*map(str, (*counts, overlap.neither)), points(gap.value, 1))
    return (*words, interval_text(gap), corrected_p_text(p_value))


def make_failure_table(data: RunData) -> Table:
    """Make the table of failures by task and setting.

    Raises:
        InvalidValueError: no episode failed.
    """
    found = count_failures(data)
    kinds = [kind for kind in FAILURES if any(counts[kind] for counts in found.values())]
    if not kinds:
        raise InvalidValueError("No episode of the runs failed.")
    rows: list[Row] = []
    for policy_run, name in data.names.items():
        own = {key: counts for key, counts in found.items() if key.policy_run == policy_run}
        for options in sorted({key.options for key in own}, key=options_sort_key):
            cells = {key.task: counts for key, counts in own.items() if key.options == options}
            if len(cells) > 1:
                cells[ALL_TASKS] = sum(cells.values(), Counter())
            trials = {key.task: data.cells[key].trials for key in own if key.options == options}
            trials[ALL_TASKS] = sum(trials.values())
            rows += [
                Row(
                    f"{name}, {options_label(options)}",
                    task,
                    tuple(_failure_words(trials[task], counts, kinds)),
                )
                for task, counts in cells.items()
            ]
    return Table(
        key="failures",
        title="Failures",
        heads=("policy and setting", "task"),
        columns=(Column("trials"), Column("failures"), *map(_failure_column, kinds)),
        rows=tuple(rows),
        notes=(_FAILURES_NOTE,),
    )


def _failure_column(kind: str) -> Column:
    groups = {"grounding": GROUNDING, "execution": EXECUTION}
    group = next((group for group, kinds in groups.items() if kind in kinds), "")
    return Column(kind.replace("_", " "), group)


def _failure_words(trials: int, counts: Counter[str], kinds: Iterable[str]) -> Iterator[str]:
    total = counts.total()
    yield from (str(trials), str(total))
    for kind in kinds:
        share = f" ({100 * counts[kind] / total:.0f} %)" if counts[kind] else ""
        yield f"{counts[kind]}{share}"


DIAGNOSTIC_TABLES: Mapping[str, Callable[[RunData], Table]] = {
    "forms": make_forms_table,
    "failures": make_failure_table,
    "heard": make_heard_table,
    "arms": make_arm_table,
}
"""By name, as in the command line."""
RECORD_TABLES: Mapping[str, Callable[[RunData, Iterable[tuple[str, Record]]], Table]] = {
    "subgoals": make_subgoal_table,
    "facts": make_facts_table,
}
"""Those that need whole records too, each with the name of its run."""
