"""Table of planners: their subgoals, what they cost, and how their episodes went wrong."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.results.option_labels import options_label
from roboirg.evaluation.analysis.results.reading import with_columns
from roboirg.evaluation.analysis.stats.cells import CellKey, rows_of
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
_COSTS = {
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
_UNKNOWN_IF_ABSENT = ("input_tokens", "output_tokens", "cost_usd")
"""What a service may not report, so that the records of its replies lack it."""


def _usage(record: Record) -> dict[str, float]:
    """Return the usage of a record, with NaN for what is unknown of the models that it asked."""
    unknown = dict.fromkeys(_UNKNOWN_IF_ABSENT, math.nan) if "calls" in record.usage else {}
    return {**unknown, **record.usage}


_READ: Mapping[str, Callable[[Record], object]] = {
    "verdicts": lambda record: tuple(one.verdict for one in record.subgoals),
    "planner_failure": planner_failure,
    "usage": _usage,
}


def make_subgoal_table(data: RunData, records: Iterable[Record]) -> Table:
    """Make the table from the whole records of the runs of `data`.

    Raises:
        InvalidValueError: no record holds a subgoal, or the failure of a planner.
    """
    frame = with_columns(data.frame, records, _READ)
    found: defaultdict[CellKey, Counter[str]] = defaultdict(Counter)
    names = ("run", "task", "options", *_READ)
    for run, task, options, verdicts, failure, usage in rows_of(frame, *names):
        if usage is not None:  # else the episode was not played
            counts = found[CellKey(run, task, options)]
            counts.update(("episodes", *verdicts))
            counts.update({name: value for name, value in usage.items() if name in _COSTS})
            if failure:
                counts[failure] += 1
    known = (*SUBGOAL_VERDICTS, *PLANNER_FAILURES)
    shown = {key: one for key, one in found.items() if any(one[name] for name in known)}
    if not shown:
        raise InvalidValueError("No planner of the runs named a subgoal; their records hold none.")
    occurring = {name for counts in shown.values() for name in counts if counts[name] > 0}
    failures = [name for name in PLANNER_FAILURES if name in occurring]
    costs = [name for name in _COSTS if name in occurring]
    notes = [_NOTE]
    if failures:
        meanings = "; ".join(f"{name}: {PLANNER_FAILURES[name]}" for name in failures)
        notes.append(f"Failed episodes, by what the planner did: {meanings}.")
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
        rows=[
            Row(
                f"{data.frame.names[key.policy_run]}, {options_label(key.options)}",
                key.task,
                list(_words(counts, failures, costs)),
            )
            for key, counts in shown.items()
        ],
        notes=notes,
    )


def _words(counts: Counter[str], failures: Iterable[str], costs: Iterable[str]) -> Iterator[str]:
    total = sum(counts[one] for one in SUBGOAL_VERDICTS)
    yield str(total)
    for one in SUBGOAL_VERDICTS:
        yield f"{counts[one]} ({100 * counts[one] / max(total, 1):.0f} %)"
    yield from (str(counts[one]) for one in failures)
    for name in costs:
        mean = counts[name] / counts["episodes"]
        yield "unknown" if math.isnan(mean) else f"{mean:.3g}"
