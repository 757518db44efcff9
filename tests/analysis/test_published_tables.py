"""From results with the published rates come the published tables, to the last digit."""

from __future__ import annotations

import csv
import math
from collections import defaultdict
from fractions import Fraction
from importlib import resources

import pytest
from flat_jobs import frame_of
from published_results import like_published

from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.published import (
    NOTES,
    RATE_TABLES,
    TRIALS,
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


@pytest.fixture(scope="module", params=RATE_TABLES)
def table_of_results_like_the_papers(request):
    results = like_published(request.param)
    return make_table(request.param, RunData(frame_of(results)), published=True)


def rows_of(table, source):
    """Return entries by place, which is the setting and the policy but for contexts, and column."""
    names = [column.name for column in table.columns]
    found = {}
    for row in table.rows:
        if row.source == source:
            place = row.group, row.name.removesuffix(TWIN_MARK)
            at = place[::-1] if table.key == "planner" else place
            found[at] = dict(zip(names, row.entries, strict=True))
    return found


def printed_entries(table_of_results_like_the_papers, source):
    """Return all that a reader sees of the rows of a source, by place and column."""
    found = {}
    for at, row in rows_of(table_of_results_like_the_papers, source).items():
        for name, entry in row.items():
            found[at, name] = (entry.text, entry.marks, entry.change, entry.best)
    return found


def test_results_with_the_papers_rates_give_the_papers_table(table_of_results_like_the_papers):
    """Every rate, average, dash and bold entry, in our rows as in the published ones."""
    ours, theirs = (
        printed_entries(table_of_results_like_the_papers, source)
        for source in ("ours", "published")
    )
    assert ours == theirs

    lines = lines_of_stored_file(table_of_results_like_the_papers.key)
    assert {place(line) for line in lines} == {at for at, _ in ours}

    for line in lines:
        text = line["success_rate_percent"]
        expected = f"{float(text):.2f}" if text else "–"
        shown, marks, *_ = ours[place(line), line["task"]]
        assert (shown, marks) == (expected, ""), line


def test_each_change_to_explicit_is_the_difference_of_the_published_rates(
    table_of_results_like_the_papers,
):
    """Computed anew from the file, in floats, without code of the package.

    In the table of contexts, changes are to the shortest context, "1,5".
    """
    rates: dict[tuple[str, str], dict[str, float]] = defaultdict(dict)
    for line in lines_of_stored_file(table_of_results_like_the_papers.key):
        if line["success_rate_percent"]:
            rates[place(line)][line["task"]] = float(line["success_rate_percent"])

    for at, entries in rows_of(table_of_results_like_the_papers, "ours").items():
        reference = ("explicit", at[1])
        if table_of_results_like_the_papers.key == "context":
            reference = (at[0], "1,5")
        before = dict(rates[reference])
        # The average of the same tasks, as some settings have not all.
        same_tasks = [before[task] for task in rates[at] if task != "Avg"]
        before["Avg"] = round(sum(same_tasks) / len(same_tasks) + 1e-9, 2)
        for column, rate in rates[at].items():
            change = entries[column].change
            if at == reference:
                assert change is None
            else:
                assert float(change) == round(rate - before[column], 2), (at, column)


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


def test_the_table_of_benchmarks_is_the_published_one_and_our_row_is_computed():
    """*Coverage* lists what each benchmark tests; ours is read off its tasks."""
    table = make_table("coverage", NO_RESULTS)
    found = [(row.group, row.name, row.cells) for row in table.rows]
    lines = [tuple(line.values()) for line in published_lines("coverage")]
    published = [(kind, name, list(words)) for name, kind, *words in lines]

    assert found == published
    assert [row.name for row in table.rows if row.source == "ours"] == ["RoboIRGBench"]


@pytest.mark.parametrize("which", WHICH)
@pytest.mark.parametrize("name", FORMATS)
def test_every_table_can_be_drawn_in_every_format_without_own_results(which, name):
    text = FORMATS[name].draw(make_table(which, NO_RESULTS, published=True))
    assert text.rstrip("\n") + "\n" == text


def test_the_paper_has_rates_for_exactly_the_tasks_that_have_a_setting_here():
    """Not every task can be told in every setting: StopCube has no spatial one."""
    for row in published_rows("main"):
        published = {task for task, rate in row.rates.items() if rate is not None}
        setting = row.options.setting
        ours = {name for name, task in all_tasks().items() if setting in settings_of(task)}
        assert published == ours, setting


def test_notes_below_published_tables_give_the_half_width_of_the_interval_of_a_cell():
    for table, (first, *_) in NOTES.items():
        half_of_trials = math.prod(TRIALS[table]) // 2
        low, high = interval_of_values([[0.0, 1.0] * half_of_trials])
        half = (high - low) / 2
        assert f"cell's is ±{100 * half:.0f} points." in first
        assert {*NOTES[table]} <= {*make_table(table, NO_RESULTS, published=True).notes}
