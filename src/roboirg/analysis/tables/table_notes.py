"""Notes below a table: the meaning of its signs, and limits of the results."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace

from roboirg.analysis.comparability import comparison_notes
from roboirg.analysis.measures.headline import headline_notes
from roboirg.analysis.measures.measured_floors import unmeasured_note
from roboirg.analysis.published import NOTES
from roboirg.analysis.results.frame import Frame
from roboirg.analysis.results.option_labels import is_usual, options_sort_key
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.analysis.results.run_cells import CellKey
from roboirg.analysis.tables.table import (
    ERROR_MARK,
    MISSING_MARK,
    PARTIAL_MARK,
    SPARED_MARK,
    Column,
    Entry,
    Row,
    Table,
)
from roboirg.analysis.tables.table_kinds import TWIN_MARK, PaperTable, TableResults
from roboirg.core.instruction_options import options_label
from roboirg.core.plain_text import counted, verb_for
from roboirg.records.mixing import mixtures
from roboirg.stats.cells import Counts
from roboirg.stats.rates import NOT_APPLICABLE
from roboirg.tasks import every_task

RATES_NOTE = (
    "Success rate in percent, the mean over policy seeds; averages are unweighted means over tasks."
)
PARTIAL_NOTE = f"{PARTIAL_MARK} a partial average: a task is incomplete or was not played."
_FLOORS_NOTE = (
    "Rows without a policy are expected success. chance: a guess among the goals that fit the "
    "command; first-mention, last-mention, elimination (a value that is not named), surface (key "
    "words): rules for the words alone; text-only, scene-only: learners that see the words or the "
    "scene alone; union: for each value the better of these two (docs/controls.md)."
)
_TWIN_NOTE = f"{TWIN_MARK.strip()}: the study's twin, in simulation, not on a robot."


def notes_of(
    table: PaperTable,
    columns: Sequence[Column],
    rows: Sequence[Row],
    results: TableResults,
    floors: Sequence[str],
) -> tuple[str, ...]:
    """Return the sentences below a table of success rates: what its signs mean, and its limits.

    Args:
        table: which of the paper's tables.
        columns: of the table.
        rows: of the table.
        results: behind the table.
        floors: names of listeners that do not understand, whose expected success is in the table.
    """
    entries: list[Entry] = []
    for row in rows:
        entries += row.entries
    notes = [RATES_NOTE, *_sign_notes(table, entries)]
    notes += _played_notes(table, results, entries)
    notes += _origin_notes(table, rows, floors, results)
    notes += comparison_notes(results.differences, results.names)
    notes += _average_notes(columns, rows)
    return tuple(filter(None, notes))  # some have nothing to say and are empty


def _played_notes(
    table: PaperTable, results: TableResults, entries: Sequence[Entry]
) -> Iterator[str]:
    """Yield sentences on what was played, and on what is missing of it in the table."""
    policy_runs = {key.policy_run for key in results.shown}
    yield where_played(policy_runs)
    yield from _count_notes([cell.counts for cell in results.shown.values()], entries)
    if len(policy_runs) == 1:
        yield "Only one policy was played; nothing is compared."
    if table.name == "main":
        yield from _omission_notes(results)
        yield from headline_notes(results.played, results.names)
    yield _absent_tasks(results.shown)


def with_mixtures(tables: Sequence[Table], frame: Frame) -> list[Table]:
    """Return tables with notes on what their results mix, such as several versions of the language.

    Control arms, which have other words on purpose, do not count.
    """
    notes = [*findings_of(frame), *mixtures(frame.without_control_arms().played)]
    noted = []
    for table in tables:
        if table.key == "coverage":
            noted.append(table)  # it is not about results
        else:
            noted.append(replace(table, notes=(*table.notes, *notes)))
    return noted


def findings_of(frame: Frame) -> Iterator[str]:
    """Yield what runs found that stop when what they compare is decided, each sentence once."""
    sentences: dict[str, None] = {}
    for policy_run in frame.names:
        sentences.update(dict.fromkeys(policy_run.findings))
    for sentence in sentences:
        yield f"Until decided: {sentence}"


def where_played(policy_runs: Collection[PolicyRun]) -> str:
    """Return a sentence with the conditions that all policy runs have in common.

    They are the split, the words and the limit of steps:
    ``Played on the test split, in own words, with at most 1300 steps.``
    """
    phrases = {
        "split": "on the {} split",
        "wordings": "in {}",
        "max_steps": "with at most {} steps",
    }
    parts = []
    for name, phrase in phrases.items():
        values = {policy_run.conditions.text(name) for policy_run in policy_runs}
        if len(values) == 1:
            parts.append(phrase.format(*values))
    if not parts:
        return ""
    return f"Played {', '.join(parts)}."


def range_text(counts: Sequence[int], noun: str) -> str:
    """Return the smallest and the largest count: ``1 to 3 trials``, or ``5 trials`` if equal."""
    low = min(counts)
    high = max(counts)
    if low == high:
        return counted(high, noun)
    return f"{low} to {counted(high, noun)}"


def _sign_notes(table: PaperTable, entries: Sequence[Entry]) -> Iterator[str]:
    """Yield sentences on what arrows, bold numbers and dashes mean, if an entry has one."""
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
    """Return a sentence on how many episodes and trials the cells (a task in a setting) have.

    For example ``10 to 50 episodes per cell, each played once.``
    """
    episodes = range_text([cell.episodes for cell in judged], "episode")
    if all(cell.episodes == cell.trials for cell in judged):
        return f"{episodes} per cell, each played once."
    trials = range_text([cell.trials for cell in judged], "trial")
    return f"{episodes} and {trials} per cell: several policy seeds."


def _origin_notes(
    table: PaperTable,
    rows: Sequence[Row],
    floors: Sequence[str],
    results: TableResults,
) -> Iterator[str]:
    """Yield sentences on rows that no policy has played here.

    They are those of a real robot's simulated twin, expected success without understanding (the
    floors), and published rates.
    """
    sources = {row.source for row in rows}
    if any(row.name.endswith(TWIN_MARK) for row in rows):
        yield _TWIN_NOTE
    if "chance" in sources:
        yield _FLOORS_NOTE
    yield unmeasured_note(floors, [key.policy_run.language for key in results.shown])
    if table.of_paper is not None and "published" in sources:
        yield from NOTES[table.of_paper]


def _count_notes(cells: Sequence[Counts], entries: Sequence[Entry]) -> Iterator[str]:
    """Yield sentences on the numbers of trials, and on those that have no verdict.

    Args:
        cells: numbers of trials of each task in each setting.
        entries: of the table; their marks are explained.
    """
    judged = []
    errors = 0
    missing = 0
    spared = 0
    for cell in cells:
        errors += cell.errors
        missing += cell.missing
        spared += cell.spared
        if cell.trials:
            judged.append(cell)
    if judged:
        yield _sizes(judged)
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
        yield PARTIAL_NOTE
    if spared:
        yield (
            f"{SPARED_MARK} until decided: {counted(spared, 'trial')} of the plan need not be "
            "played. Such rates have no interval, and no protocol's number is made of them."
        )
    if errors or missing or spared:
        yield "Incomplete entries have no arrow, and their columns no best entry."


def _omission_notes(results: TableResults) -> Iterator[str]:
    """Yield sentences on what was played but is not in the main table: other tasks or settings.

    Settings that have a table of their own, that of harder settings, are named apart.
    """
    other_tasks = set()
    hidden = set()
    for key in results.played:
        if key.task not in results.tasks:
            other_tasks.add(key.task)
        elif key not in results.shown:
            hidden.add(key.options)
    if other_tasks:
        yield f"Not in this table: the results of {', '.join(sorted(other_tasks))}."
    harder: list[str] = []
    other: list[str] = []
    for options in sorted(hidden, key=options_sort_key):
        labels = harder if is_usual(options) else other
        labels.append(options_label(options))
    if harder:
        yield f"In the table harder: {'; '.join(harder)}."
    if other:
        yield f"Not in this table: {'; '.join(other)}."


def _absent_tasks(shown: Iterable[CellKey]) -> str:
    """Return a sentence on tasks that were played but are not installed here; empty without any."""
    absent = {key.task for key in shown} - every_task().keys()
    if not absent:
        return ""
    names = ", ".join(sorted(absent))
    return f"The package with {names} is not installed: what its runs lack is not counted."


def _average_notes(columns: Sequence[Column], rows: Sequence[Row]) -> Iterator[str]:
    """Yield a sentence for each setting that some tasks lack, so that its averages have fewer.

    Such an average is compared with explicit's over the same tasks, which is not the one that is
    printed: the note warns of subtracting the two.
    """
    played_rows = [row for row in rows if row.source == "ours"]
    if played_rows:
        rows = played_rows  # of what was played, whatever the paper or the floors have
    played = []  # the numbers of the columns of tasks that were played
    for number, column in enumerate(columns):
        has_rate = any(row.entries[number].percent is not None for row in rows)
        if has_rate and not column.averages:
            played.append(number)
    tasks_of_groups = {}
    for row in rows:
        tasks_of_groups[row.group] = sum(row.entries[number].applies for number in played)
    for group, number in tasks_of_groups.items():
        if 0 < number < len(played):
            yield (
                f"Averages of {group} are over the {number} of {len(played)} tasks that have it; "
                "their changes are from the average over the same tasks."
            )
