"""Notes below a table: the meaning of its signs, and limits of the results."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from roboirg.core.plain_text import counted, verb_for
from roboirg.evaluation.analysis.comparability import AllDifferences, comparison_notes
from roboirg.evaluation.analysis.published import NOTES
from roboirg.evaluation.analysis.results.frame import Frame, RunNames
from roboirg.evaluation.analysis.results.option_labels import (
    is_usual,
    options_label,
    options_sort_key,
)
from roboirg.evaluation.analysis.results.policy_run import EvalConditions
from roboirg.evaluation.analysis.stats.cells import Cells, Counts
from roboirg.evaluation.analysis.stats.chance import unmeasured_note
from roboirg.evaluation.analysis.stats.headline import headline_notes
from roboirg.evaluation.analysis.stats.rates import NOT_APPLICABLE
from roboirg.evaluation.analysis.tables.table import (
    ERROR_MARK,
    MISSING_MARK,
    PARTIAL_MARK,
    Column,
    Entry,
    Row,
    Table,
)
from roboirg.evaluation.analysis.tables.table_kinds import TWIN_MARK, PaperTable
from roboirg.evaluation.records.mixing import mixtures
from roboirg.tasks import every_task

RATES_NOTE = (
    "Success rate in percent, the mean over policy seeds; averages are unweighted means over tasks."
)
_FLOORS_NOTE = (
    "Rows without a policy are expected success. chance: a guess among the goals that fit the "
    "command; first-mention, last-mention, elimination (a value that is not named), surface (key "
    "words): rules for the words alone; text-only, scene-only: learners that see the words or the "
    "scene alone; union: for each value the better of these two (docs/floors.md)."
)
_TWIN_NOTE = f"{TWIN_MARK.strip()}: the study's twin, in simulation, not on a robot."


def notes_of(
    table: PaperTable,
    columns: Sequence[Column],
    rows: Sequence[Row],
    cells: Cells,
    names: RunNames,
    differences: AllDifferences,
    floors: Sequence[str],
) -> tuple[str, ...]:
    """Return the notes of a table of rates, for which some floors are asked for."""
    tasks = columns[-1].averages
    shown = {
        key: cell for key, cell in cells.items() if key.task in tasks and table.shows(key.options)
    }
    counts = [cell.counts for cell in shown.values()]
    entries = [entry for row in rows for entry in row.entries]
    policy_runs = list(dict.fromkeys(key.policy_run for key in shown))
    compared = {key: one for key, one in differences.items() if key in shown}
    sources = {row.source for row in rows}
    notes = (
        RATES_NOTE,
        *_sign_notes(table, entries),
        where_played([one.conditions for one in policy_runs]),
        _sizes([one for one in counts if one.trials]),
        *_incomplete_notes(counts, entries),
        "Only one policy was played; nothing is compared." * (len(policy_runs) == 1),
        *(_omission_notes(table, cells, tasks) if table.name == "main" else ()),
        *(headline_notes(cells, names) if table.name == "main" else ()),
        _absent_tasks({key.task for key in shown}),
        _TWIN_NOTE * any(row.name.endswith(TWIN_MARK) for row in rows),
        _FLOORS_NOTE * ("chance" in sources),
        unmeasured_note(floors, [one.language for one in policy_runs if one.language]),
        *(NOTES[table.of_paper] if table.of_paper and "published" in sources else ()),
        *comparison_notes(compared, names),
        *_average_notes(columns, rows),
    )
    return tuple(filter(None, notes))


def with_mixtures(tables: Sequence[Table], frame: Frame) -> list[Table]:
    """Return tables with a note on everything that their results do not have in common."""
    found = mixtures(frame.told().played)
    return [
        table if table.key == "coverage" else replace(table, notes=(*table.notes, *found))
        for table in tables
    ]


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


def range_text(counts: Sequence[int], noun: str) -> str:
    """Return the smallest and the largest count, once if they are equal, with their noun."""
    low, high = min(counts), max(counts)
    return f"{low} to " * (low < high) + counted(high, noun)


def _sign_notes(table: PaperTable, entries: Sequence[Entry]) -> Iterator[str]:
    if any(entry.change is not None for entry in entries):
        reference = "the shortest context" if table.is_by_stages else "explicit"
        yield (
            f"↑ above, ↓ below, → equal to {reference} of the same policy, by how many points, "
            "as printed, on the same tasks; an arrow does not imply a significant difference."
        )
    if any(entry.best for entry in entries):
        whose = "policy in a setting" if table.name == "planner" else "of its group"
        yield f"Bold: the best {whose}."
    if any(not entry.applies for entry in entries):
        yield f"{NOT_APPLICABLE} the setting is not defined for the task."


def _sizes(judged: Sequence[Counts]) -> str:
    """Return how many episodes and trials the cells with a verdict have."""
    if not judged:
        return ""
    episodes = range_text([one.episodes for one in judged], "episode")
    if all(one.episodes == one.trials for one in judged):
        return f"{episodes} per cell, each played once."
    trials = range_text([one.trials for one in judged], "trial")
    return f"{episodes} and {trials} per cell: several policy seeds."


def _incomplete_notes(counts: Sequence[Counts], entries: Sequence[Entry]) -> Iterator[str]:
    errors = sum(one.errors for one in counts)
    missing = sum(one.missing for one in counts)
    if errors:
        yield (
            f"{ERROR_MARK} {counted(errors, 'trial')} ended in an error and "
            f"{verb_for(errors, 'are')} left out of the rates."
        )
    if missing:
        yield (
            f"{MISSING_MARK} {counted(missing, 'trial')} of the plan "
            f"{verb_for(missing, 'are')} still to be played."
        )
    if any(PARTIAL_MARK in entry.marks for entry in entries):
        yield f"{PARTIAL_MARK} a partial average: a task is incomplete or was not played."
    if errors or missing:
        yield "Incomplete entries have no arrow, and their columns no best entry."


def _omission_notes(table: PaperTable, cells: Cells, tasks: Sequence[str]) -> Iterator[str]:
    others = sorted({key.task for key in cells if key.task not in tasks})
    if others:
        yield f"Not in this table: the results of {', '.join(others)}."
    hidden = {key.options for key in cells if key.task in tasks and not table.shows(key.options)}
    for is_harder, where in ((True, "In the table harder"), (False, "Not in this table")):
        found = [one for one in sorted(hidden, key=options_sort_key) if is_usual(one) == is_harder]
        if found:
            yield f"{where}: {'; '.join(map(options_label, found))}."


def _absent_tasks(names: set[str]) -> str:
    """Say which tasks are not installed here."""
    listed = ", ".join(sorted(names - every_task().keys()))
    text = f"The package with {listed} is not installed: what its runs lack is not counted."
    return text if listed else ""


def _average_notes(columns: Sequence[Column], rows: Sequence[Row]) -> Iterator[str]:
    """Say which changes of averages are over fewer tasks than the reference's own average."""
    own = [
        index
        for index, column in enumerate(columns)
        if not column.averages and any(row.entries[index].percent is not None for row in rows)
    ]
    fewer = {row.group: sum(row.entries[index].applies for index in own) for row in rows}
    for group, number in fewer.items():
        if 0 < number < len(own):
            yield (
                f"Averages of {group} are over the {number} of {len(own)} tasks that have it; "
                "their changes are from the average over the same tasks."
            )
