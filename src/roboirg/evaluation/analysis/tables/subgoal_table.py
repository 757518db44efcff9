"""Table of planners' subgoals: how many were what was due, by task and setting."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.stats.cells import CellKey
from roboirg.evaluation.analysis.stats.option_labels import options_label
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.table import Column, Entry, Row, Table
from roboirg.evaluation.records.record import Record
from roboirg.judging import SUBGOAL_VERDICTS

_NOTE = (
    "Subgoals that a planner named, counted when they or the due stage were new: what was due; "
    "another thing, or a point off it; another place for the right thing; the right act for "
    "another time; or an act that was not due (lost). Shares are of the cell's subgoals."
)


def make_subgoal_table(data: RunData, records: Iterable[tuple[str, Record]]) -> Table:
    """Make the table from the records of the runs of `data`, each with the name of its run.

    Raises:
        InvalidValueError: no record holds a subgoal.
    """
    found: defaultdict[CellKey, Counter[str]] = defaultdict(Counter)
    for run, record in records:
        key = CellKey(data.owner(run, record), record.task, record.column)
        found[key].update(one.verdict for one in record.subgoals)
    rows = [
        Row(
            f"{data.names[key.policy_run]}, {options_label(key.options)}", key.task, "ours", entries
        )
        for key in data.cells
        if (entries := _entries(found.get(key, {})))
    ]
    if not rows:
        raise InvalidValueError("No planner of the runs named a subgoal; their records hold none.")
    return Table(
        key="subgoals",
        title="Subgoals of planners",
        heads=("policy and setting", "task"),
        columns=(Column("subgoals"), *(Column(one.replace("_", " ")) for one in SUBGOAL_VERDICTS)),
        rows=tuple(rows),
        notes=(_NOTE,),
    )


def _entries(counts: Mapping[str, int]) -> tuple[Entry, ...]:
    total = sum(counts.values())
    if not total:
        return ()
    shares = (
        f"{counts.get(one, 0)} ({100 * counts.get(one, 0) / total:.0f} %)"
        for one in SUBGOAL_VERDICTS
    )
    return (Entry(word=str(total)), *(Entry(word=share) for share in shares))
