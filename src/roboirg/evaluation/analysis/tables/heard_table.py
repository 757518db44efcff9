"""Table of cut prompts, and of success over the episodes that were heard whole."""

from __future__ import annotations

from fractions import Fraction

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.stats.heard_rates import (
    HeardCounts,
    add_up,
    count_heard,
    cut_text,
    sorted_keys,
)
from roboirg.evaluation.analysis.stats.option_labels import options_label
from roboirg.evaluation.analysis.stats.rates import percent
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.stats.run_summary import ALL_TASKS
from roboirg.evaluation.analysis.tables.table import (
    NOT_APPLICABLE,
    Column,
    Counts,
    Entry,
    Row,
    Table,
)

COLUMNS = tuple(map(Column, ("episodes", "cut, %", "success, all", "heard", "success, heard")))
NOTE = (
    "Cut: the policy's model reads fewer tokens than the prompt needs, so the end of the prompt, "
    "where the command stands, does not arrive; between two bounds if the tokenizer is not "
    "known. Success in percent over all episodes with a verdict, and over those that were heard "
    "whole. Policies that declare no limit (prompt_tokens) are not in this table."
)


def make_heard_table(data: RunData) -> Table:
    """Make the table, one row for each cell and for all tasks.

    Raises:
        InvalidValueError: no policy declares how many tokens it reads.
    """
    names = data.names
    cells = count_heard(data.results)
    if not cells:
        raise InvalidValueError(
            "No policy of the runs declares how many tokens it reads; prompt_tokens=N does."
        )
    rows: list[Row] = []
    totals = add_up(cells)
    keys = sorted_keys(cells, list(names))
    for place, key in enumerate(keys):
        group = f"{names[key.policy_run]}, {options_label(key.options)}"
        rows.append(Row(group, key.task, _cells(cells[key])))
        owner = key.policy_run, key.options
        is_last = place + 1 == len(keys) or keys[place + 1][::2] != owner
        if is_last and sum(one[::2] == owner for one in keys) > 1:
            rows.append(Row(group, ALL_TASKS, _cells(totals[owner])))
    return Table(
        key="heard",
        title="Instructions that the policies' models read to the end",
        heads=("policy and setting", "task"),
        columns=COLUMNS,
        rows=tuple(rows),
        notes=(NOTE,),
    )


def _cells(one: HeardCounts) -> tuple[Entry | str, ...]:
    return (
        str(one.episodes),
        cut_text(one),
        _rate(one.successes, one.trials),
        str(one.heard),
        _rate(one.heard_successes, one.heard),
    )


def _rate(successes: int, trials: int) -> Entry | str:
    if not trials:
        return NOT_APPLICABLE
    return Entry(percent=percent(Fraction(successes, trials)), counts=Counts(successes, trials))
