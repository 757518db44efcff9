"""Table of planners: their subgoals, what they cost, and how their episodes went wrong."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.stats.cells import CellKey
from roboirg.evaluation.analysis.stats.option_labels import options_label
from roboirg.evaluation.analysis.stats.planner_failures import PLANNER_FAILURES, planner_failure
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.table import Column, Row, Table
from roboirg.evaluation.records.record import Record
from roboirg.judging import SUBGOAL_VERDICTS

_NOTE = (
    "Subgoals that a planner named, each counted when it or the due stage was new: right (the one "
    "that was due), wrong thing (or a point off it), wrong place (for the right thing), wrong "
    "count (the right act at another time), or lost (an act that was not due). Shares are of the "
    "cell's subgoals."
)
_COSTS: Mapping[str, str] = {
    "calls": "calls",
    "input_tokens": "tokens in",
    "output_tokens": "tokens out",
    "cost_usd": "US$",
    "answered_s": "s for answers",
    "waited_s": "s in queues",
    "refused": "refusals",
    "missed": "misses",
}
"""What a planner costs: keys of a record's usage, and their headings."""


@dataclass
class _PlannerCell:
    """What the records of one cell add up to."""

    episodes: int = 0
    verdicts: Counter[str] = field(default_factory=Counter)
    failures: Counter[str] = field(default_factory=Counter)
    costs: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))

    def add(self, record: Record) -> None:
        self.episodes += 1
        self.verdicts.update(one.verdict for one in record.subgoals)
        if (failure := planner_failure(record)) is not None:
            self.failures[failure] += 1
        for name in _COSTS:
            self.costs[name] += record.usage.get(name, 0)

    def words(self, failures: Iterable[str], costs: Iterable[str]) -> Iterator[str]:
        total = self.verdicts.total()
        yield str(total)
        for one in SUBGOAL_VERDICTS:
            share = 100 * self.verdicts[one] / max(total, 1)
            yield f"{self.verdicts[one]} ({share:.0f} %)"
        yield from (str(self.failures[one]) for one in failures)
        for name in costs:
            yield f"{self.costs[name] / self.episodes:.3g}"


def make_subgoal_table(data: RunData, records: Iterable[tuple[str, Record]]) -> Table:
    """Make the table from the records of the runs of `data`, each with the name of its run.

    Raises:
        InvalidValueError: no record holds a subgoal, or the failure of a planner.
    """
    found: defaultdict[CellKey, _PlannerCell] = defaultdict(_PlannerCell)
    for run, record in records:
        found[CellKey(data.owner(run, record), record.task, record.column)].add(record)
    shown = {key: found[key] for key in data.cells if found[key].verdicts or found[key].failures}
    if not shown:
        raise InvalidValueError("No planner of the runs named a subgoal; their records hold none.")
    failures = [one for one in PLANNER_FAILURES if any(it.failures[one] for it in shown.values())]
    costs = [one for one in _COSTS if any(it.costs[one] for it in shown.values())]
    meanings = "; ".join(f"{one}: {PLANNER_FAILURES[one]}" for one in failures)
    notes = (_NOTE, *([f"Failed episodes, by what the planner did: {meanings}."] * bool(failures)))
    return Table(
        key="subgoals",
        title="Subgoals of planners",
        heads=("policy and setting", "task"),
        columns=(
            Column("subgoals"),
            *(Column(one.replace("_", " ")) for one in SUBGOAL_VERDICTS),
            *(Column(one, "failed episodes") for one in failures),
            *(Column(_COSTS[one], "per episode") for one in costs),
        ),
        rows=tuple(
            Row(
                f"{data.names[key.policy_run]}, {options_label(key.options)}",
                key.task,
                tuple(cell.words(failures, costs)),
            )
            for key, cell in shown.items()
        ),
        notes=notes,
    )
