"""Table of planners: their subgoals, what they cost, and how their episodes went wrong."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

from roboirg.analysis.measures.planner_failures import PLANNER_FAILURES, planner_failure
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.reading import with_columns
from roboirg.analysis.results.run_cells import CellKey
from roboirg.analysis.tables.table import Column, Row, Table
from roboirg.core.errors import InvalidValueError
from roboirg.judging import SUBGOAL_VERDICTS
from roboirg.records.record import Record
from roboirg.stats.cells import rows_of
from roboirg.stats.rates import half_up, whole_percent

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
    if "calls" not in record.usage:
        return dict(record.usage)
    unknown = dict.fromkeys(_UNKNOWN_IF_ABSENT, math.nan)
    return {**unknown, **record.usage}


_READ: Mapping[str, Callable[[Record], object]] = {
    "verdicts": lambda record: tuple(subgoal.verdict for subgoal in record.subgoals),
    "planner_failure": planner_failure,
    "usage": _usage,
}
"""What the table reads of whole records."""


def make_subgoal_table(data: RunData) -> Table:
    """Make the table of planners, which name subgoals to a policy: right ones, costs, failures.

    It has a row for each task in each setting of a policy, from the whole records of its episodes.

    Raises:
        InvalidValueError: no record holds a subgoal, the failure of a planner, or a call.
    """
    counts_by_cell = _count_in_cells(data)
    if not counts_by_cell:
        raise InvalidValueError("No policy of the runs named a subgoal or asked a model.")
    # Only failures and costs that occur have columns.
    failures = _occurring(PLANNER_FAILURES, counts_by_cell.values())
    costs = _occurring(_COSTS, counts_by_cell.values())
    rows = []
    for key, counts in counts_by_cell.items():
        group = data.frame.group_label(key.policy_run, key.options)
        rows.append(Row(group, key.task, list(_words(counts, failures, costs))))
    return Table(
        key="subgoals",
        title="Subgoals of planners, and what models cost",
        heads=("policy and setting", "task"),
        columns=_columns(failures, costs),
        rows=rows,
        notes=_notes(failures),
    )


def _occurring(names: Iterable[str], cells: Collection[Counter[str]]) -> list[str]:
    """Return those of some names that any cell has counted, in their order."""
    found = []
    for name in names:
        if any(counts[name] > 0 for counts in cells):
            found.append(name)
    return found


def _notes(failures: Sequence[str]) -> list[str]:
    """Return the sentences below the table; they explain the failures that have columns."""
    if not failures:
        return [_NOTE]
    meanings = "; ".join(f"{failure}: {PLANNER_FAILURES[failure]}" for failure in failures)
    return [_NOTE, f"Failed episodes, by what the planner did: {meanings}."]


def _columns(failures: Iterable[str], costs: Iterable[str]) -> list[Column]:
    """Return the columns of the table of planners: subgoals by verdict, failures, and costs.

    Only failures and costs that occur are given, and have columns.
    """
    columns = [Column("subgoals")]
    for verdict in SUBGOAL_VERDICTS:
        columns.append(Column(verdict.replace("_", " ")))
    for failure in failures:
        columns.append(Column(failure, "failed episodes"))
    for cost in costs:
        columns.append(Column(_COSTS[cost], "per episode"))
    return columns


def _count_in_cells(data: RunData) -> dict[CellKey, Counter[str]]:
    """Count subgoals by verdict, failures by name, and costs, in each task and setting.

    A cell is a policy run in a task and setting, for example
    ``{"episodes": 10, "right": 31, "wrong_place": 2, "calls": 40, …}``: numbers of episodes,
    subgoals and failures, and sums of costs. Cells in which no planner did anything are left out.
    """
    frame = with_columns(data.frame, data.records, _READ)
    counts_by_cell: defaultdict[CellKey, Counter[str]] = defaultdict(Counter)
    names = ("run", "task", "options", *_READ)
    for run, task, options, verdicts, failure, usage in rows_of(frame, *names):
        if usage is None:
            continue  # the episode was not played
        counts = counts_by_cell[CellKey(run, task, options)]
        counts["episodes"] += 1
        counts.update(verdicts)
        if failure:
            counts[failure] += 1
        for name in _COSTS:
            if name in usage:
                counts[name] += usage[name]

    return {key: counts for key, counts in counts_by_cell.items() if _has_planner(counts)}


def _has_planner(counts: Counter[str]) -> bool:
    """Return whether a planner named a subgoal or failed, or a model was asked, in an episode."""
    return any(counts[name] for name in (*SUBGOAL_VERDICTS, *PLANNER_FAILURES, "calls"))


def _words(counts: Counter[str], failures: Iterable[str], costs: Iterable[str]) -> Iterator[str]:
    """Yield the texts of a row of the table of planners, one for each column.

    These are the number of subgoals, that of each verdict with its share, such as ``31 (94 %)``,
    the failed episodes by failure, and the mean costs of an episode.

    Args:
        counts: of the row's episodes, subgoals and failures, and the sums of its costs.
        failures: names of those that have a column.
        costs: names of those that have a column.
    """
    total = sum(counts[verdict] for verdict in SUBGOAL_VERDICTS)
    yield str(total)
    for verdict in SUBGOAL_VERDICTS:
        share = counts[verdict] / max(total, 1)
        yield f"{counts[verdict]} ({whole_percent(share)} %)"
    for failure in failures:
        yield str(counts[failure])
    for cost in costs:
        yield _mean_text(counts[cost] / counts["episodes"])


def _mean_text(mean: float) -> str:
    """Return a mean cost: ``0.0125``, ``4``, ``1234``; *unknown* for NaN, an unknown cost.

    It has at least three digits, rounded half up, and no zeros at the end of its decimals.
    """
    if math.isnan(mean):
        return "unknown"
    decimals = 0
    if mean > 0:
        decimals = max(0, 2 - math.floor(math.log10(mean)))
    return f"{half_up(mean, decimals).normalize():f}"
