"""The overview of the page: success by policy, task and telling, as heat maps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from roboirg.analysis.page.entries import EpisodeEntries, in_order, task_order
from roboirg.analysis.stats.intervals import Interval
from roboirg.analysis.stats.run_summary import Scope, SummaryRow, summarize
from roboirg.analysis.stats.samples import PolicyRun, Samples, gather
from roboirg.analysis.stats.success_rates import EXPLICIT, SettingColumn
from roboirg.analysis.tables.run_tables import ALL_TASKS, percent, points
from roboirg.core.episode import DIFFICULTIES
from roboirg.tasks import all_tasks

SEED = 20_240_607
"""Of the bootstrap; the same records give the same page."""

_SURE = 0.001


class MatrixRow(NamedTuple):
    """A row of every heat map."""

    name: str
    kind: str
    scope: Scope


def make_matrix(entries: EpisodeEntries) -> dict[str, Any]:
    """The heat maps as JSON values: columns, rows, and cells by policy, row and column.

    One set of cells for everything and, where there are several, one for each difficulty. What is
    planned and not played has no difficulty yet; it counts among everything.
    """
    told = sorted({variant for _, _, variant in entries.samples}, key=SettingColumn.sort_key)
    rows = _rows(entries.samples)
    levels = {"": entries.samples}
    found = {entry.record.difficulty for entry in entries.all}
    if len(found) > 1:
        levels |= {
            level: _only(entries, level) for level in (*DIFFICULTIES, *found) if level in found
        }
    return {
        "policies": list(entries.names.values()),
        "columns": [
            {"setting": one._replace(form="implicit").label, "form": one.form, "name": one.label}
            for one in told
        ],
        "rows": [{"name": row.name, "kind": row.kind, **row.scope._asdict()} for row in rows],
        "levels": [
            {"difficulty": level, "cells": _cells(samples, entries.names, rows, told)}
            for level, samples in levels.items()
        ],
    }


def _rows(samples: Samples) -> list[MatrixRow]:
    tasks = task_order({task for _, task, _ in samples})
    suites: dict[str, list[str]] = {}
    for task in tasks:
        known = all_tasks().get(task)
        suites.setdefault(known.suite if known else "", []).append(task)
    rows = [MatrixRow(ALL_TASKS, "all", Scope())] if len(tasks) > 1 else []
    for suite, members in suites.items():
        if suite and len(suites) > 1 and len(members) > 1:
            rows.append(MatrixRow(suite, "suite", Scope(suite=suite)))
        rows += [MatrixRow(task, "task", Scope(task=task)) for task in members]
    return rows


def _only(entries: EpisodeEntries, difficulty: str) -> Samples:
    """The samples of one difficulty, each policy of each run by itself."""
    found: dict[tuple[PolicyRun, str, SettingColumn], Any] = {}
    for run in dict.fromkeys(entry.who.run for entry in entries.all):
        records = [
            entry.record
            for entry in entries.all
            if entry.who.run == run and entry.record.difficulty == difficulty
        ]
        for (who, task, told), sample in gather([(run, records)]).items():
            found[who._replace(run=run), task, told] = sample
    return in_order(found, list(entries.names))


def _cells(
    samples: Samples,
    names: Mapping[PolicyRun, str],
    rows: Sequence[MatrixRow],
    told: Sequence[SettingColumn],
) -> list[dict[str, Any]]:
    places = {who: place for place, who in enumerate(names)}
    lines = {row.scope: line for line, row in enumerate(rows)}
    return [
        {
            "at": [places[one.contestant], lines[one.scope], told.index(one.variant)],
            **_cell(one, f"{names[one.contestant]}, {rows[lines[one.scope]].name}"),
        }
        for one in summarize(samples, np.random.default_rng(SEED))
        if one.scope in lines
    ]


def _cell(one: SummaryRow, where: str) -> dict[str, Any]:
    cell: dict[str, Any] = {"note": notes(one, where)}
    if one.rate is not None:
        cell |= {"rate": round(float(one.rate), 4), "text": percent(float(one.rate))}
    if one.interval is not None:
        cell["interval"] = [round(end, 4) for end in one.interval]
    if one.gap is not None:
        cell |= {"gap": round(one.gap.value, 4), "gap_text": points(one.gap.value)}
        if one.gap.retention is None and not one.gap.value:
            cell["floor"] = True
    cell |= {name: count for name in ("errors", "missing") if (count := getattr(one, name))}
    return cell


def notes(one: SummaryRow, where: str) -> list[str]:
    """A cell in words: first where it is, then what came of it."""
    lines = [f"{where}, {one.variant.label}"]
    if one.rate is None:
        lines.append("no verdict yet")
    else:
        mean = f", mean of {len(one.tasks)} tasks" if len(one.tasks) > 1 else ""
        lines.append(
            f"{percent(float(one.rate))} % success{mean}: {one.successes} of {one.trials} trials, "
            f"{one.episodes} episodes"
        )
        if one.interval is not None:
            lines.append(f"95 % interval {_percents(one.interval)} %")
    lines += _gap_notes(one)
    if one.errors:
        lines.append(f"{one.errors} ended in an error and are in no rate")
    if one.missing:
        lines.append(f"{one.missing} are still to be played")
    return lines


def _gap_notes(one: SummaryRow) -> list[str]:
    lines: list[str] = []
    if one.gap is not None and one.variant != EXPLICIT:
        if one.gap.retention is None:
            lines.append(
                f"{points(one.gap.value)} points to explicit, where nothing succeeded either: "
                "that says nothing" if not one.gap.value else
                f"{points(one.gap.value)} points to explicit, where nothing succeeded"
            )  # fmt: skip
        else:
            lines.append(
                f"{points(one.gap.value)} points to explicit on {one.gap.episodes} same episodes"
                f"{_within(one.gap.interval)}, {_p_text(one.p_holm)}"
            )
    if one.form_gap is not None:
        lines.append(
            f"{points(one.form_gap.value)} points to the resolved form"
            f"{_within(one.form_gap.interval)}"
        )
    return lines


def _within(interval: Interval | None) -> str:
    return "" if interval is None else f" ({points(interval.low)} to {points(interval.high)})"


def _percents(interval: Interval) -> str:
    return f"{percent(interval.low)} to {percent(interval.high)}"


def _p_text(p_value: float | None) -> str:
    if p_value is None:
        return "not tested"
    return "corrected p < 0.001" if p_value < _SURE else f"corrected p = {p_value:.3f}"
