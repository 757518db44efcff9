"""Notes below a table: the meaning of its signs, and limits of the results."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from typing import TYPE_CHECKING

from roboirg.core.plain_text import counted, verb_for
from roboirg.evaluation.analysis.comparability import AllDifferences, comparison_notes
from roboirg.evaluation.analysis.published import TRIALS, RateTable, published_rows
from roboirg.evaluation.analysis.results.frame import Frame
from roboirg.evaluation.analysis.results.option_labels import (
    is_usual,
    options_label,
    options_sort_key,
    staged_options,
)
from roboirg.evaluation.analysis.results.policy_run import EvalConditions, PolicyRun
from roboirg.evaluation.analysis.stats.cells import Cell, Cells
from roboirg.evaluation.analysis.stats.headline import headline_notes
from roboirg.evaluation.analysis.stats.intervals import wilson_interval
from roboirg.evaluation.analysis.stats.rates import NOT_APPLICABLE, change_text
from roboirg.evaluation.analysis.tables.table import (
    ERROR_MARK,
    MISSING_MARK,
    PARTIAL_MARK,
    PUBLISHED_MARK,
    Column,
    Entry,
    Row,
    Table,
)
from roboirg.evaluation.records.mixing import mixtures
from roboirg.language.settings import EXPLICIT
from roboirg.tasks import every_task

if TYPE_CHECKING:
    from roboirg.evaluation.analysis.tables.paper_tables import PaperTable

RATES_NOTE = (
    "Success rate in percent, the mean over policy seeds; averages are unweighted means over tasks."
)
_FLOORS_NOTE = (
    "Rows without a policy are expected success. chance: a guess among the goals that fit the "
    "command; first-mention, last-mention, elimination (a value that is not named), surface (key "
    "words): rules for the words alone; text-only, scene-only: learners that see the words or the "
    "scene alone; union: for each value the better of these two (docs/floors.md)."
)
TWIN_MARK = " (twin)"


def notes_of(
    table: PaperTable,
    rows: Sequence[Row],
    cells: Cells,
    names: Mapping[PolicyRun, str],
    tasks: Sequence[str],
    differences: AllDifferences,
) -> tuple[str, ...]:
    """Return the notes of a table of rates."""
    shown = {
        key: cell for key, cell in cells.items() if key.task in tasks and table.shows(key.options)
    }
    entries = [entry for row in rows for entry in row.entries]
    policy_runs = list(dict.fromkeys(key.policy_run for key in shown))
    compared = {key: one for key, one in differences.items() if key in shown}
    notes = (
        RATES_NOTE,
        *_sign_notes(table, entries),
        where_played([one.conditions for one in policy_runs]),
        *_size_notes(shown.values()),
        *_incomplete_notes(shown.values(), entries),
        "Only one policy was played; nothing is compared." * (len(policy_runs) == 1),
        *(_omission_notes(table, cells, tasks) if table.name == "main" else ()),
        *(headline_notes(cells, names) if table.name == "main" else ()),
        *_absent_notes({key.task for key in shown}),
        *_twin_notes(rows),
        _FLOORS_NOTE * any(row.source == "chance" for row in rows),
        *_published_notes(table, rows),
        *comparison_notes(compared, names),
    )
    return tuple(filter(None, notes))


def with_mixtures(table: Table, frame: Frame) -> Table:
    """Return a table with a note on everything that its results do not have in common."""
    return replace(table, notes=(*table.notes, *mixtures(frame.told().played)))


def _sign_notes(table: PaperTable, entries: Sequence[Entry]) -> list[str]:
    notes = []
    if any(entry.change is not None for entry in entries):
        reference = "the shortest context" if table.is_by_stages else "explicit"
        notes.append(
            f"↑ above, ↓ below, → equal to {reference} of the same policy, by how many points, as "
            "printed, on the same tasks; an arrow does not imply a significant difference."
        )
    if any(entry.best for entry in entries):
        whose = "policy in a setting" if table.name == "planner" else "of its group"
        notes.append(f"Bold: the best {whose}.")
    if any(not entry.applies for entry in entries):
        notes.append(f"{NOT_APPLICABLE} the setting is not defined for the task.")
    return notes


def average_notes(
    columns: Sequence[Column], rows: Sequence[Row], reference_of: Callable[[Row], Row | None]
) -> list[str]:
    """Say which changes of averages are over fewer tasks than the reference's own average.

    The paper subtracts averages over different tasks; what it prints is given, too.
    """
    notes = []
    tasks = columns[-1].averages
    own = [index for index, column in enumerate(columns) if not column.averages]
    fewer = {row.group: sum(row.entries[index].applies for index in own) for row in rows}
    for group, number in fewer.items():
        if 0 < number < len(tasks):
            notes.append(
                f"Averages of {group} are over the {number} of {len(tasks)} tasks that have it; "
                "their changes are from the average over the same tasks."
            )
            printed = [
                f"{row.name} {change_text(last - before)}"
                for row in rows
                if row.group == group and row.source == "published"
                if (last := row.entries[-1].percent) is not None
                if (reference := reference_of(row)) is not None
                if (before := reference.entries[-1].percent) is not None
            ]
            if printed:
                notes[-1] += (
                    f" The paper's changes are from the average over all {len(tasks)}: "
                    f"{', '.join(printed)}."
                )
    return notes


def _absent_notes(names: Iterable[str]) -> list[str]:
    """Say which tasks are not installed here."""
    absent = sorted(set(names) - every_task().keys())
    if not absent:
        return []
    listed = ", ".join(absent)
    return [f"The package with {listed} is not installed: what its runs lack is not counted."]


def where_played(conditions: Sequence[EvalConditions]) -> str:
    """Return a sentence with the split, the words and the limit, if all have the same."""
    usual = {
        "split": "on the {} split",
        "wordings": "in {}",
        "max_steps": "with at most {} steps",
    }
    found = {name: {one.text(name) for one in conditions} for name in usual}
    words = [usual[name].format(*values) for name, values in found.items() if len(values) == 1]
    return f"Played {', '.join(words)}." if words else ""


def _size_notes(cells: Iterable[Cell]) -> list[str]:
    judged = [cell.counts for cell in cells if cell.verdicts]
    if not judged:
        return []
    episodes = _range([cell.episodes for cell in judged], "episode")
    trials = _range([cell.trials for cell in judged], "trial")
    if all(cell.episodes == cell.trials for cell in judged):
        return [f"{episodes} per cell, each played once."]
    return [f"{episodes} and {trials} per cell: several policy seeds."]


def _incomplete_notes(cells: Iterable[Cell], entries: Iterable[Entry]) -> list[str]:
    found = list(cells)
    notes = []
    errors, missing = sum(one.errors for one in found), sum(one.missing for one in found)
    if errors:
        verb = verb_for(errors, "are")
        notes.append(
            f"{ERROR_MARK} {counted(errors, 'trial')} ended in an error and {verb} left out of "
            "the rates."
        )
    if missing:
        verb = verb_for(missing, "are")
        notes.append(
            f"{MISSING_MARK} {counted(missing, 'trial')} of the plan {verb} still to be played."
        )
    if any(PARTIAL_MARK in entry.marks for entry in entries):
        notes.append(f"{PARTIAL_MARK} a partial average: a task is incomplete or was not played.")
    if errors or missing:
        notes.append("Incomplete entries have no arrow, and their columns no best entry.")
    return notes


def _omission_notes(table: PaperTable, cells: Cells, tasks: Sequence[str]) -> list[str]:
    other_tasks = sorted({key.task for key in cells if key.task not in tasks})
    other_options = sorted(
        {key.options for key in cells if key.task in tasks and not table.shows(key.options)},
        key=options_sort_key,
    )
    notes = []
    if other_tasks:
        notes.append(f"Not in this table: the results of {', '.join(other_tasks)}.")
    for is_harder, where in ((True, "In the table harder"), (False, "Not in this table")):
        found = [one for one in other_options if is_usual(one) == is_harder]
        if found:
            notes.append(f"{where}: {'; '.join(map(options_label, found))}.")
    return notes


def _twin_notes(rows: Iterable[Row]) -> list[str]:
    if any(row.name.endswith(TWIN_MARK) for row in rows):
        return [f"{TWIN_MARK.strip()}: the study's twin, in simulation, not on a robot."]
    return []


def _published_notes(table: PaperTable, rows: Iterable[Row]) -> list[str]:
    which = table.of_paper
    if which is None or not any(row.source == "published" for row in rows):
        return []
    episodes, seeds = TRIALS[which]
    trials = f"{episodes} trials" if seeds == 1 else f"{episodes} episodes × {seeds} seeds"
    where = "on its own robot" if which == "real" else "played in its own simulator"
    suites = " Averages of suites, where they are shown, are ours." if which == "main" else ""
    low, high = wilson_interval(episodes * seeds // 2, episodes * seeds)
    source = (
        f"{PUBLISHED_MARK.strip()}: from the paper, {trials} per cell, {where}. It prints no "
        f"intervals; at 50 % a cell's is ±{50 * (high - low):.0f} points.{suites}"
    )
    return [
        source,
        *_unequal_average_notes(which),
        *_shortest_context_notes(which),
    ]


def _unequal_average_notes(which: RateTable) -> list[str]:
    """Say where the paper sets an average over some tasks against one over all."""
    rows = published_rows(which)
    explicit = {row.model: row for row in rows if row.options.setting == EXPLICIT}
    drops: dict[str, list[str]] = {}
    for row in rows:
        tasks = [task for task, rate in row.rates.items() if rate is not None]
        if len(tasks) < len(row.rates) and (same := explicit[row.model].average_over(tasks)):
            printed = explicit[row.model].average - row.average
            text = f"{row.model} {printed} and {same - row.average}"
            drops.setdefault(row.options.setting, []).append(text)
    return [
        f"The paper compares its {setting} averages, which are over fewer tasks, with the "
        "explicit ones over all. Drops as printed, and on the same tasks, as in this table: "
        f"{', '.join(texts)}."
        for setting, texts in drops.items()
    ]


def _shortest_context_notes(which: RateTable) -> list[str]:
    """Say how far the paper's shortest context is from its direct setting."""
    if which != "context":
        return []
    direct = {row.model: row for row in published_rows("main") if row.options.setting == "direct"}
    gaps = [
        abs((rate or Decimal(0)) - (direct[row.model].rates[task] or Decimal(0)))
        for row in published_rows(which)
        if row.options == staged_options()[0]
        for task, rate in row.rates.items()
    ]
    text = (
        "The published rows with the shortest context differ from the paper's direct setting in "
        f"{sum(map(bool, gaps))} of {len(gaps)} cells, by up to {max(gaps)} points."
    )
    return [text]


def _range(counts: Sequence[int], noun: str) -> str:
    low, high = min(counts), max(counts)
    return counted(high, noun) if low == high else f"{low} to {counted(high, noun)}"
