"""The overview of the page: success by policy, task and setting, as heat maps."""

from __future__ import annotations

from roboirg.core.episode import DIFFICULTIES
from roboirg.core.plain_text import counted
from roboirg.evaluation.analysis.page.columns import setting_label
from roboirg.evaluation.analysis.page.episodes import JsonObject, PageEpisodes
from roboirg.evaluation.analysis.results.frame import suite, task_order
from roboirg.evaluation.analysis.results.option_labels import options_label, options_sort_key
from roboirg.evaluation.analysis.stats.cells import Cells, cells_of
from roboirg.evaluation.analysis.stats.intervals import TOO_FEW
from roboirg.evaluation.analysis.stats.measure import (
    ALL_TASKS,
    ScopeSummary,
    Summaries,
    summarize,
)
from roboirg.evaluation.analysis.stats.rates import interval_note, p_text, points, whole_percent


def make_matrix(episodes: PageEpisodes) -> JsonObject:
    """Return the heat maps as JSON values: columns, rows, and cells by policy, row and column.

    There is one set of cells for all episodes and, if there are several difficulties, one for
    each. Missing episodes have no difficulty yet; they count among all episodes only.
    """
    columns = sorted({key.options for key in episodes.data.cells}, key=options_sort_key)
    rows = _rows(episodes.data.cells)
    places = {policy_run: place for place, policy_run in enumerate(episodes.names)}
    lines = {scope: line for line, scope in enumerate(rows)}

    def cells(summaries: Summaries) -> list[JsonObject]:
        return [
            {
                "at": [places[key.policy_run], lines[key.scope], columns.index(key.options)],
                **_cell(one, f"{episodes.names[key.policy_run]}, {key.scope}"),
            }
            for key, one in summaries.items()
            if key.scope in lines
        ]

    found = {one.record.difficulty for one in episodes.all}
    levels = [{"difficulty": "", "cells": cells(episodes.data.summaries)}]
    for level in DIFFICULTIES if len(found) > 1 else ():
        if level in found:
            summaries = summarize(cells_of(episodes.data.frame.where(difficulty=level)))
            levels.append({"difficulty": level, "cells": cells(summaries)})
    return {
        "policies": list(episodes.names.values()),
        "columns": [
            {"setting": setting_label(one), "form": one.form, "name": options_label(one)}
            for one in columns
        ],
        "rows": [{"name": name, **scope} for name, scope in rows.items()],
        "levels": levels,
    }


def _rows(cells: Cells) -> dict[str, dict[str, str | None]]:
    """Return the rows of every heat map by scope, each with its task or suite."""
    suites: dict[str | None, list[str]] = {}
    for task in task_order({key.task for key in cells}):
        suites.setdefault(suite(task), []).append(task)
    rows: dict[str, dict[str, str | None]] = {}
    if sum(map(len, suites.values())) > 1:
        rows[ALL_TASKS] = {"task": None, "suite": None}
    for name, members in suites.items():
        if name is not None and len(suites) > 1 and len(members) > 1:
            rows[name] = {"task": None, "suite": name}
        rows |= {task: {"task": task, "suite": None} for task in members}
    return rows


def _cell(one: ScopeSummary, subject: str) -> JsonObject:
    cell: JsonObject = {"note": notes(one, subject)}
    if one.rate is not None:
        cell |= {"rate": round(float(one.rate), 4), "text": whole_percent(one.rate)}
    if one.interval is not None:
        cell["interval"] = [round(end, 4) for end in one.interval]
    if one.gap is not None:
        cell |= {"gap": round(one.gap.value, 4), "gap_text": points(one.gap.value)}
        if one.gap.retention is None and not one.gap.value:
            cell["floor"] = True
    cell |= {name: count for name in ("errors", "missing") if (count := getattr(one.counts, name))}
    return cell


def notes(one: ScopeSummary, subject: str) -> list[str]:
    """Return a cell in words: first its subject, then its results."""
    lines = [f"{subject}, {options_label(one.key.options)}"]
    counts = one.counts
    if one.rate is None:
        lines.append("no verdict yet")
    else:
        mean = f", mean of {len(one.tasks)} tasks" if len(one.tasks) > 1 else ""
        lines.append(
            f"{whole_percent(one.rate)} % success{mean}: {counts.successes} of "
            f"{counted(counts.trials, 'trial')}, {counted(counts.episodes, 'episode')}"
        )
        if one.interval is None:
            lines.append(TOO_FEW)
        else:
            low, high = map(whole_percent, one.interval)
            lines.append(f"95 % interval {low} to {high} %")
    lines += _gap_notes(one)
    if counts.errors:
        lines.append(f"{counted(counts.errors, 'error')} left out of the rates")
    if counts.missing:
        lines.append(f"{counts.missing} still to be played")
    return lines


def _gap_notes(one: ScopeSummary) -> list[str]:
    lines: list[str] = []
    if one.gap is not None:
        gap = f"{points(one.gap.value)} points to explicit"
        if one.gap.retention is not None:
            tested = "not tested" if one.p_holm is None else f"{p_text(one.p_holm)} (Holm)"
            lines.append(
                f"{gap} on the same {counted(one.gap.episodes, 'episode')}"
                f"{interval_note(one.gap.interval)}, {tested}"
            )
        elif one.gap.value:
            lines.append(f"{gap}, which has no success")
        else:
            lines.append(f"{gap}, which has no success either, so the gap says nothing")
    if one.second_gap is not None:
        lines.append(
            f"{points(one.second_gap.value)} points to the resolved form"
            f"{interval_note(one.second_gap.interval)}"
        )
    return lines
