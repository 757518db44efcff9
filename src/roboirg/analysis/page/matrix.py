"""The overview of the page: success by policy, task and setting, as heat maps."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

from roboirg.analysis.measures.measure import (
    ALL_TASKS,
    ScopeSummary,
    Summaries,
    summarize,
)
from roboirg.analysis.page.columns import setting_label
from roboirg.analysis.page.episodes import JsonObject, PageEpisodes
from roboirg.analysis.results.frame import suite, task_order
from roboirg.analysis.results.option_labels import options_sort_key
from roboirg.analysis.results.run_cells import Cells, cells_of
from roboirg.core.episode import DIFFICULTIES
from roboirg.core.instruction_options import InstructionOptions, options_label
from roboirg.core.plain_text import counted
from roboirg.stats.intervals import TOO_FEW, Interval
from roboirg.stats.rates import interval_note, p_text, points, whole_percent


def make_matrix(episodes: PageEpisodes) -> JsonObject:
    """Return the page's heat maps of success by task and setting, one for each policy.

    They are JSON values, and have common rows and columns. There is one set of cells for all
    episodes and, if there are several difficulties of scenes, one for each. Missing episodes have
    no difficulty yet; they count among all episodes only.
    """
    data = episodes.data
    columns = sorted({key.options for key in data.cells}, key=options_sort_key)
    rows = _rows(data.cells)
    levels = []
    for difficulty, summaries in _summaries_by_level(episodes).items():
        cells = _cells(episodes, summaries, columns, list(rows))
        levels.append({"difficulty": difficulty, "cells": cells})
    return {
        "policies": list(episodes.names.values()),
        "columns": list(map(_heading, columns)),
        "rows": [{"name": name, **scope} for name, scope in rows.items()],
        "levels": levels,
    }


def _summaries_by_level(episodes: PageEpisodes) -> dict[str, Summaries]:
    """Return success by the difficulty of scenes; under an empty text, that of all episodes.

    If all episodes have the same difficulty, there is only the latter.
    """
    data = episodes.data
    summaries = {"": data.summaries}
    occurring = {record.difficulty for record in episodes.records}
    if len(occurring) > 1:
        for difficulty in DIFFICULTIES:
            if difficulty in occurring:
                cells = cells_of(data.frame.where(difficulty=difficulty))
                summaries[difficulty] = summarize(cells)
    return summaries


def _heading(options: InstructionOptions) -> JsonObject:
    """Return the heading of a column."""
    label = setting_label(options)
    return {"setting": label, "form": options.form, "name": options_label(options)}


def _cells(
    episodes: PageEpisodes,
    summaries: Summaries,
    columns: Sequence[InstructionOptions],
    rows: Sequence[str],
) -> list[JsonObject]:
    """Return the cells of all heat maps; ``at`` has the numbers of policy, row and column.

    Args:
        episodes: of the page, with the labels of the policies.
        summaries: success by policy run, scope (a task, a suite or all tasks) and options.
        columns: the options of each column.
        rows: the scope of each row.
    """
    policies = list(episodes.names)
    cells = []
    for key, summary in summaries.items():
        if key.scope not in rows:
            continue  # a suite with a single task
        policy = policies.index(key.policy_run)
        place = [policy, rows.index(key.scope), columns.index(key.options)]
        subject = f"{episodes.names[key.policy_run]}, {key.scope}"
        cells.append({"at": place, **_cell(summary, subject)})
    return cells


def _rows(cells: Cells) -> dict[str, JsonObject]:
    """Return the rows of every heat map by what they average: all tasks, a suite, or one task.

    They are all tasks, then each suite with its tasks below it, such as
    ``{"StopCube": {"task": "StopCube", "suite": None}}``. An average of a single task is left out,
    and that of a suite if it has all tasks.
    """
    tasks = task_order({key.task for key in cells})
    suites = defaultdict(list)
    for task in tasks:
        suites[suite(task)].append(task)
    rows: dict[str, JsonObject] = {}
    if len(tasks) > 1:
        rows[ALL_TASKS] = {"task": None, "suite": None}
    for name, members in suites.items():
        if name is not None and len(suites) > 1 and len(members) > 1:
            rows[name] = {"task": None, "suite": name}
        for task in members:
            rows[task] = {"task": task, "suite": None}
    return rows


def _cell(summary: ScopeSummary, subject: str) -> JsonObject:
    """Return what a cell of a heat map shows: success, gap to explicit, incomplete trials, a note.

    Explicit is the setting that names the goal. What is not known is left out.

    Args:
        summary: success, 0 to 1, in a task, suite or all tasks with some options.
        subject: policy and scope in words, for the note.
    """
    cell: JsonObject = {"note": notes(summary, subject)}
    if summary.rate is not None:
        cell["rate"] = round(float(summary.rate), 4)
        cell["text"] = whole_percent(summary.rate)
    if summary.interval is not None:
        cell["interval"] = [round(end, 4) for end in summary.interval]
    gap = summary.gap
    if gap is not None:
        cell["gap"] = round(gap.value, 4)
        cell["gap_text"] = points(gap.value)
        if gap.retention is None and not gap.value:
            cell["floor"] = True  # neither has a success, so the gap is not shown as one
    if summary.counts.errors:
        cell["errors"] = summary.counts.errors
    if summary.counts.missing:
        cell["missing"] = summary.counts.missing
    if summary.counts.spared:
        cell["spared"] = summary.counts.spared
    return cell


def notes(summary: ScopeSummary, subject: str) -> list[str]:
    """Return the sentences that explain a cell of a heat map: success, gaps, incomplete trials.

    For example ``pi0, PickXtimes, ordinal``, ``62 % success: 31 of 50 trials, 50 episodes``, …
    """
    lines = [f"{subject}, {options_label(summary.key.options)}"]
    counts = summary.counts
    if summary.rate is None:
        lines.append("no verdict yet")
    else:
        mean = ""
        if len(summary.tasks) > 1:
            mean = f", mean of {len(summary.tasks)} tasks"
        lines.append(
            f"{whole_percent(summary.rate)} % success{mean}: {counts.successes} of "
            f"{counted(counts.trials, 'trial')}, {counted(counts.episodes, 'episode')}"
        )
        if summary.key.policy_run.is_until_decided:
            lines.append("no interval: the run stopped when it was decided")
        else:
            lines.append(_interval_note(summary.interval))
    lines += _gap_notes(summary)
    if counts.errors:
        lines.append(f"{counted(counts.errors, 'error')} left out of the rates")
    if counts.missing:
        lines.append(f"{counts.missing} still to be played")
    if counts.spared:
        lines.append(f"{counts.spared} need not be played")
    return lines


def _interval_note(interval: Interval | None) -> str:
    if interval is None:
        return TOO_FEW
    return f"95 % interval {whole_percent(interval.low)} to {whole_percent(interval.high)} %"


def _gap_notes(summary: ScopeSummary) -> list[str]:
    """Return how success differs from that in explicit words, and in resolved ones, as sentences.

    Explicit instructions name the goal; resolved ones say the same with each reference replaced by
    what it means. The gap to explicit is tested only if explicit has a success to lose, that is, if
    there is a retention, the share of it that is kept.
    """
    lines = []
    gap = summary.gap
    if gap is not None:
        text = f"{points(gap.value)} points to explicit"
        if gap.retention is not None:
            episodes = counted(gap.episodes, "episode")
            tested = "not tested"
            if summary.p_holm is not None:
                tested = f"{p_text(summary.p_holm)} (Holm)"
            text += f" on the same {episodes}{interval_note(gap.interval)}, {tested}"
        elif gap.value:
            text += ", which has no success"
        else:
            text += ", which has no success either, so the gap says nothing"
        lines.append(text)
    second_gap = summary.second_gap
    if second_gap is not None:
        lines.append(
            f"{points(second_gap.value)} points to the resolved form"
            f"{interval_note(second_gap.interval)}"
        )
    return lines
