"""The page of the paper's experiment: published and own tables, and the same questions to both."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from roboirg.apps.learning.policy.paper_experiment import (
    CONTEXT,
    MAIN,
    PARTS,
    RESOLVED,
    SYSTEMS,
    row_name,
    row_of,
    run_of,
)
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.published import TRIALS, PublishedRow, published_rows
from roboirg.evaluation.analysis.results.frame import Frame, make_frame
from roboirg.evaluation.analysis.results.option_labels import staged_options
from roboirg.evaluation.analysis.stats.cells import Cell, CellKey, Cells, cells_of
from roboirg.evaluation.analysis.stats.intervals import ALPHA, SEED, Z_95, Interval
from roboirg.evaluation.analysis.stats.measure import ALL_TASKS, Measured, ScopeKey, summarize
from roboirg.evaluation.analysis.stats.paired_tests import Gap, Pairs, holm, measure_gap
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.paper_tables import is_informative, make_table
from roboirg.evaluation.analysis.tables.rendering.markdown import markdown
from roboirg.evaluation.records.record import Summary
from roboirg.evaluation.records.store import read_results
from roboirg.language.settings import EXPLICIT, plain_settings
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.atomic_write import write_atomically

PAGE = "paper.md"
TABLES = ("main", "context", "planner")
FIRST = "none"
"""The memory that the others are compared with."""
_TITLE = "# The paper's experiment with small policies"
_INTRODUCTION = (
    "Rows called *small-…* have a mechanism of the paper on the small body of the learned policy. "
    "They are not the paper's systems; the page *The paper's mechanisms on a small body* of the "
    "documentation lists what differs. Published rates have 150 rollouts in each cell. Policies "
    "that differ in their training seed alone are one row; intervals are over scenes."
)


class Difference(NamedTuple):
    """A difference of two rates, 0 to 1.

    Attributes:
        value: the first less the second.
        interval: 95 %.
        p_value: not corrected.
    """

    value: float
    interval: Interval | None
    p_value: float


Column = Mapping[str, Difference]
"""By row."""


def write_paper_page(folder: Path) -> Path:
    """Write the page of the runs that were played, and return its path."""
    runs = {part: run_of(folder, part) for part in PARTS if part != RESOLVED}
    found = {part: row_frame(part, read_results(run)) for part, run in runs.items() if run.exists()}
    page = folder / PAGE
    write_atomically(page, f"{_TITLE}\n\n{_INTRODUCTION}\n\n{results_text(found)}\n")
    return page


def row_frame(part: str, results: Iterable[Summary]) -> Frame:
    """Return a part's results, without control arms; policies are rows."""
    rows = [_of_row(one) for one in results]
    return make_frame([(part, rows)], planned=rows).told()  # in the order of the records


def results_text(found: Mapping[str, Frame]) -> str:
    """Return tables and answers in Markdown; policies of each part are rows."""
    return "\n\n".join(part for part in (tables_text(found), answers_text(found)) if part)


def tables_text(found: Mapping[str, Frame]) -> str:
    """Return the paper's tables of the parts, with its rates."""
    shown = [
        markdown(make_table(which, RunData(found[which]), published=True)).rstrip()
        for which in TABLES
        if which in found and (which == "planner" or is_informative(which, RunData(found[which])))
    ]
    return "\n\n".join(shown)


def answers_text(found: Mapping[str, Frame]) -> str:
    """Return the paper's questions with the answers of the parts and of its rates."""
    main = _questions(cells_of(found[MAIN])) if MAIN in found else ()
    context = _stage_question(cells_of(found[CONTEXT])) if CONTEXT in found else ()
    return "\n\n".join([*main, *context])


def _of_row(result: Summary) -> Summary:
    """Return the result of a policy as one of its row: a training seed counts as a policy seed."""
    row, seed = row_of(result.policy)
    trained = replace(result.ref, version="trained")
    return msgspec.structs.replace(result, policy=row, policy_seed=seed, ref=trained)


def _questions(main: Cells) -> Iterator[str]:
    settings = [name for name in plain_settings() if name != EXPLICIT]
    averages = _averages(main)
    yield "## Does explicit success carry over, and which setting costs most?"
    yield "Success in each setting less explicit success on the same scenes, in points."
    yield _table(
        settings, lambda one: _own_gaps(averages, one), lambda one: _published(one, EXPLICIT)
    )
    yield "## Do memory and referring come apart?"
    yield "Success less that of the row without memory, in points."
    every = [EXPLICIT, *settings]
    yield _table(every, lambda one: _own_against(main, one), lambda one: _published(one, None))
    groups = _task_groups()
    yield "## Where does memory help?"
    yield "Explicit success less that of the row without memory, in points, by group of tasks."
    yield _table(
        list(groups),
        lambda one: _own_against(main, EXPLICIT, groups[one]),
        lambda one: _published(EXPLICIT, None, groups[one]),
    )
    yield "## Do planners keep more?"
    yield "Success in each setting by explicit success, in percent."
    yield _retention(averages, settings)
    if any(one.second_gap for one in averages):
        yield "## Do resolved forms recover it?"
        yield "Success with references replaced by names less success with references, in points."
        yield _table(settings, lambda one: _own_form_gaps(averages, one), lambda _: {})


def _task_groups() -> dict[str, list[str]]:
    """Return the tasks of each suite, and those with a video."""
    found: dict[str, list[str]] = {}
    for name, task in all_tasks().items():
        found.setdefault(task.suite, []).append(name)
    with_video = [name for name in all_tasks() if get_episode(name, "test", 0).demonstration]
    return found | {"with a video": with_video}


def _stage_question(context: Cells) -> Iterator[str]:
    shortest, *longer = staged_options()
    named = {_stages(one): one for one in longer}
    yield "## Does success fall with each stage of the context?"
    yield f"Success less that with the stages {_stages(shortest)} alone, in points."
    yield _table(
        list(named),
        lambda one: _own_longer(context, named[one], shortest),
        lambda one: _published_longer(named[one], shortest),
    )


def _stages(options: InstructionOptions) -> str:
    return ", ".join(map(str, options.stages))


def _table(
    columns: Sequence[str],
    ours: Callable[[str], Column],
    published: Callable[[str], Column],
) -> str:
    """Return a table of differences; a star marks p at most 0.05 with Holm's correction by row."""
    found = [{**ours(name), **published(name)} for name in columns]
    rows = list(dict.fromkeys(row for column in found for row in column))
    cells = {}
    for row in rows:
        own = [column.get(row) for column in found]
        adjusted = iter(holm([one.p_value for one in own if one is not None]))
        cells[row] = ["–" if one is None else _difference_text(one, next(adjusted)) for one in own]
    note = "\\* p ≤ 0.05 with Holm's correction over the row. In parentheses: 95 % intervals."
    return f"{_grid(columns, cells)}\n\n{note}"


def _grid(columns: Sequence[str], cells: Mapping[str, Sequence[str]]) -> str:
    """Return a Markdown table of the cells of each row."""
    lines = [f"| row | {' | '.join(columns)} |", f"| --- |{' --- |' * len(columns)}"]
    lines += [f"| {row} | {' | '.join(own)} |" for row, own in cells.items()]
    return "\n".join(lines)


def _difference_text(one: Difference, p_value: float) -> str:
    star = "\\*" if p_value <= ALPHA else ""
    ends = "" if one.interval is None else " ({:+.0f} to {:+.0f})".format(*_percent(one.interval))
    return f"{100 * one.value:+.1f}{star}{ends}"


def _percent(interval: Interval) -> tuple[float, float]:
    return 100 * interval.low, 100 * interval.high


def _averages(cells: Cells) -> list[Measured[ScopeKey]]:
    """Return the averages over tasks of implicit forms."""
    return [
        one
        for key, one in summarize(cells).items()
        if key.scope == ALL_TASKS and key.options.form == "implicit"
    ]


def _own_gaps(averages: Sequence[Measured[ScopeKey]], setting: str) -> dict[str, Difference]:
    return {
        one.key.policy_run.policy: _as_difference(one.gap)
        for one in averages
        if one.gap and one.key.options.setting == setting
    }


def _own_form_gaps(averages: Sequence[Measured[ScopeKey]], setting: str) -> dict[str, Difference]:
    found = {}
    for one in averages:
        if one.second_gap is not None and one.key.options.setting == setting:
            gap = _as_difference(one.second_gap)
            ends = gap.interval
            turned = None if ends is None else Interval(-ends.high, -ends.low)
            found[one.key.policy_run.policy] = Difference(-gap.value, turned, gap.p_value)
    return found


def _as_difference(gap: Gap) -> Difference:
    return Difference(gap.value, gap.interval, gap.p_value)


def _own_against(
    cells: Cells, setting: str, tasks: Collection[str] | None = None
) -> dict[str, Difference]:
    """Return each row less the first one on the same episodes, averaged over tasks; None: all."""
    own = {
        key: cell
        for key, cell in cells.items()
        if key.options.setting == setting
        and key.options.form == "implicit"
        and (tasks is None or key.task in tasks)
    }
    name = row_name(FIRST)
    first = {key.task: cell for key, cell in own.items() if key.policy_run.policy == name}
    return _paired(
        (key, cell, first.get(key.task))
        for key, cell in own.items()
        if key.policy_run.policy != name
    )


def _own_longer(
    cells: Cells, options: InstructionOptions, shortest: InstructionOptions
) -> dict[str, Difference]:
    """Return success with some stages less that with the fewest, averaged over tasks."""
    return _paired(
        (key, cell, cells.get(key._replace(options=replace(key.options, stages=shortest.stages))))
        for key, cell in cells.items()
        if key.options.stages == options.stages
    )


def _paired(
    found: Iterable[tuple[CellKey, Cell, Cell | None]],
) -> dict[str, Difference]:
    """Return the difference of the cells of each policy to others on the same episodes."""
    by_policy: dict[str, list[Pairs]] = {}
    for key, cell, other in found:
        if other is not None:
            by_policy.setdefault(key.policy_run.policy, []).append(Pairs.of(cell, other))
    gaps = {
        policy: measure_gap(pairs, np.random.default_rng(SEED))
        for policy, pairs in by_policy.items()
    }
    return {policy: _as_difference(gap) for policy, gap in gaps.items() if gap is not None}


def _published(
    setting: str, reference: str | None, tasks: Collection[str] | None = None
) -> dict[str, Difference]:
    """Return published rates less those of the setting `reference`, or less the first system's.

    The trials of two published cells are taken as independent, as only their rates are known.
    """
    rows = {(one.model, one.options.setting): one for one in published_rows("main")}
    found = {}
    for system in SYSTEMS.values():
        other = (system, reference) if reference else (SYSTEMS[FIRST], setting)
        if other != (system, setting):
            found[system] = _independent(rows[system, setting], rows[other], tasks)
    return found


def _published_longer(
    options: InstructionOptions, shortest: InstructionOptions
) -> dict[str, Difference]:
    """Return published rates with some stages less those with the fewest."""
    rows = {(one.model, one.options): one for one in published_rows("context")}
    systems = dict.fromkeys(model for model, _ in rows)
    return {
        system: _independent(rows[system, options], rows[system, shortest]) for system in systems
    }


def _independent(
    first: PublishedRow, second: PublishedRow, among: Collection[str] | None = None
) -> Difference:
    tasks = [
        task
        for task, rate in first.rates.items()
        if rate is not None and (among is None or task in among)
    ]
    ours, theirs = ([_share(one.rates[task]) for task in tasks] for one in (first, second))
    trials = math.prod(TRIALS["main"])
    variance = sum(one * (1 - one) for one in (*ours, *theirs)) / trials / len(tasks) ** 2
    value, spread = sum(ours) / len(tasks) - sum(theirs) / len(tasks), math.sqrt(variance)
    interval = Interval(value - Z_95 * spread, value + Z_95 * spread)
    p_value = math.erfc(abs(value) / spread / math.sqrt(2)) if spread else 1.0
    return Difference(value, interval, p_value)


def _share(rate: Decimal | None) -> float:
    return 0.0 if rate is None else float(rate) / 100


def _retention(averages: Sequence[Measured[ScopeKey]], settings: Sequence[str]) -> str:
    kept: dict[str, dict[str, str]] = {}
    for one in averages:
        if one.gap is not None and one.gap.retention is not None:
            ends = one.gap.retention_interval
            shown = "" if ends is None else " ({:.0f} to {:.0f})".format(*_percent(ends))
            text = f"{100 * one.gap.retention:.0f}{shown}"
            kept.setdefault(one.key.policy_run.policy, {})[one.key.options.setting] = text
    rows = {(one.model, one.options.setting): one for one in published_rows("main")}
    for system in SYSTEMS.values():
        for setting in settings:
            own, explicit = rows[system, setting], rows[system, EXPLICIT]
            tasks = [task for task, rate in own.rates.items() if rate is not None]
            whole = explicit.average_over(tasks)
            if whole:
                kept.setdefault(system, {})[setting] = f"{100 * own.average / whole:.0f}"
    return _grid(
        settings, {row: [own.get(name, "–") for name in settings] for row, own in kept.items()}
    )
