"""From results with the published rates come the published tables, to the last digit."""

from __future__ import annotations

import csv
import functools
from decimal import Decimal
from fractions import Fraction
from importlib import resources

import pytest
from flat_jobs import frame_of
from published_results import like_published

from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.published import (
    NOTES,
    RATE_TABLES,
    published_lines,
    published_rows,
)
from roboirg.analysis.tables.paper_tables import WHICH, make_table
from roboirg.analysis.tables.rendering import FORMATS
from roboirg.analysis.tables.table_kinds import TWIN_MARK
from roboirg.language.settings import settings_of
from roboirg.stats.intervals import interval_of_values
from roboirg.stats.rates import mean_percent, percent
from roboirg.tasks import all_tasks

NO_RESULTS = RunData(frame_of())
FILES = {"main": "main", "planner": "planner", "context": "context", "real": "real_world"}


def lines_of_stored_file(table):
    """Return the lines of the file of a table as they are, without the package's loader."""
    path = resources.files("roboirg.analysis") / "published_results" / f"{FILES[table]}.csv"
    return list(csv.DictReader(path.read_text().splitlines()))


def place(line):
    """The group and the name of the row to which a line of a file belongs."""
    if "stages" in line:
        return line["model"], line["stages"]
    return line["setting"], line.get("model") or line["planner"]


@functools.cache
def entries_like_the_papers(key, source="ours"):
    """Return the entries of a table of results with the paper's rates, by row and column.

    A row is the setting and the policy, in the table of contexts the policy and the stages.

    Args:
        key: the name of the table.
        source: whether the rows are `ours`, of these results, or `published`.
    """
    results = like_published(key)
    table = make_table(key, RunData(frame_of(results)), published=True)
    found = {}
    for row in table.rows:
        if row.source == source:
            at = (row.group, row.name.removesuffix(TWIN_MARK))
            if key == "planner":
                at = at[::-1]
            for column, entry in zip(table.columns, row.entries, strict=True):
                found[at, column.name] = entry
    return found


def what_a_reader_sees(entry):
    return entry.text, entry.marks, entry.change, entry.best


@pytest.mark.parametrize("key", RATE_TABLES)
def test_results_with_the_papers_rates_have_the_entries_of_the_published_rows(key):
    """`key` names a table of the paper. Made-up results win as many trials as it prints.

    Of these results the table computes rates, averages, changes to explicit, and which are best
    (bold). Each has to equal what stands below in the published rows, which repeat the paper.
    """
    ours = entries_like_the_papers(key, source="ours")
    published = entries_like_the_papers(key, source="published")

    assert ours.keys() == published.keys() != set()
    for row_and_column, entry in ours.items():
        expected = what_a_reader_sees(published[row_and_column])
        assert what_a_reader_sees(entry) == expected, row_and_column


@pytest.mark.parametrize("key", RATE_TABLES)
def test_results_with_the_papers_rates_give_the_rates_in_the_stored_file(key):
    """A rate that the file lacks is a dash."""
    entries = entries_like_the_papers(key)

    for line in lines_of_stored_file(key):
        rate = line["success_rate_percent"]
        entry = entries[place(line), line["task"]]
        assert entry.text == (f"{float(rate):.2f}" if rate else "–"), line
        assert entry.marks == "", line


@pytest.mark.parametrize(
    ("key", "row", "column", "rate", "change"),
    [
        ("main", ("explicit", "pi0.5"), "Avg", "22.73", None),
        ("main", ("spatial", "MemER"), "PickXtimes", "26.67", "-44.66"),
        ("main", ("spatial", "MemER"), "Avg", "26.29", "-29.04"),
        ("planner", ("direct", "QwenVL"), "PickXtimes", "85.33", "-2.67"),
        ("context", ("FrameS-Modul", "1,2,3,5"), "Avg", "26.45", "-2.66"),
        ("real", ("direct", "pi0.5"), "PickByCount", "20.00", "-30.00"),
    ],
    ids=["explicit itself", "a task", "average of 7 tasks", "planner", "shortest context", "real"],
)
def test_each_change_to_explicit_is_the_difference_of_the_published_rates(
    key, row, column, rate, change
):
    """MemER has 71.33 in PickXtimes, explicit, and 55.33 in the seven tasks with places.

    In the table of contexts changes are to the shortest context, "1,5", which has 29.11.
    """
    entry = entries_like_the_papers(key)[row, column]

    assert entry.text == rate
    assert entry.change == (None if change is None else Decimal(change))


@pytest.mark.parametrize(
    ("table", "rates", "trials"),
    [("main", 255, 150), ("planner", 30, 150), ("context", 36, 150), ("real", 20, 10)],
)
def test_each_published_average_is_the_mean_of_its_rates_and_each_rate_a_count_of_trials(
    table, rates, trials
):
    """A rate is k of so many trials, rounded half up. Finds typing errors."""
    found = 0
    for row in published_rows(table):
        row_rates = [rate for rate in row.rates.values() if rate is not None]
        assert row.average == mean_percent(row_rates), row
        for rate in row_rates:
            successes = round(Fraction(rate) * trials / 100)
            assert percent(Fraction(successes, trials)) == rate, row
        found += len(row_rates)
    assert found == rates


def test_the_table_of_benchmarks_is_the_published_one():
    """It says which settings each benchmark tests: direct, reasoning, spatial, contextual.

    The rows of other benchmarks are read from a copy of the paper's table. That of our benchmark is
    computed from its tasks, all four are *yes*, and has to be as in the copy.
    """
    published = [list(line.values()) for line in published_lines("coverage")]

    table = make_table("coverage", NO_RESULTS)

    assert [[row.name, row.group, *row.cells] for row in table.rows] == published
    (ours,) = [row for row in table.rows if row.source == "ours"]
    assert (ours.name, ours.cells) == ("RoboIRGBench", ["yes"] * 4)


@pytest.mark.parametrize("which", WHICH)
def test_every_table_can_be_drawn_in_every_format_without_own_results(which):
    """A drawn table ends with one line break."""
    table = make_table(which, NO_RESULTS, published=True)

    for name, kind in FORMATS.items():
        text = kind.draw(table)
        assert text.rstrip("\n") + "\n" == text, name


def test_the_paper_has_rates_for_exactly_the_tasks_that_have_a_setting_here():
    """Not every task can be told in every setting: StopCube has no spatial one."""
    for row in published_rows("main"):
        published = {task for task, rate in row.rates.items() if rate is not None}
        setting = row.options.setting
        ours = {name for name, task in all_tasks().items() if setting in settings_of(task)}
        assert published == ours, setting


@pytest.mark.parametrize(
    ("key", "trials", "half_width"),
    [("main", 150, 8), ("planner", 150, 8), ("context", 150, 8), ("real", 10, 29)],
)
def test_a_note_below_a_published_table_gives_the_half_width_of_the_interval_of_a_cell(
    key, trials, half_width
):
    """The paper prints no intervals, but the trials of a cell: 50 episodes × 3 seeds, or 10.

    Expected is the interval of a rate of 50 %: half of the trials are won (1) and half lost (0).
    It reaches so many points to each side. All other notes on the paper's table stand there, too.
    """
    low, high = interval_of_values([[0.0, 1.0] * (trials // 2)])

    notes = make_table(key, NO_RESULTS, published=True).notes

    assert round(100 * (high - low) / 2) == half_width
    assert f"at 50 % a cell's is ±{half_width} points." in " ".join(notes)
    assert {*NOTES[key]} <= {*notes}
