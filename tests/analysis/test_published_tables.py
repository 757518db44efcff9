"""From results with the published rates come the published tables, to the last digit."""

from __future__ import annotations

import csv
from decimal import Decimal
from fractions import Fraction
from importlib import resources

import pytest

from roboirg.core.errors import UnknownNameError
from roboirg.evaluation.analysis.published import (
    RATE_TABLES,
    TRIALS,
    published_coverage,
    published_rows,
    published_tasks,
)
from roboirg.evaluation.analysis.stats.rates import mean_percent, percent
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.paper_tables import make_table
from roboirg.evaluation.analysis.tables.rendering import FORMATS
from roboirg.evaluation.analysis.tables.table import Row, Table
from roboirg.evaluation.analysis.tables.table_notes import TWIN_MARK
from roboirg.language import STAGE_SETS
from roboirg.language.settings import settings_of
from roboirg.tasks import all_tasks

FILES = {"main": "main", "planner": "planner", "context": "context", "real": "real_world"}


def printed(table: str) -> list[dict[str, str]]:
    """The file as it is, without the loader."""
    path = (
        resources.files("roboirg.evaluation.analysis") / "published_results" / f"{FILES[table]}.csv"
    )
    return list(csv.DictReader(path.read_text().splitlines()))


def place(line: dict[str, str]) -> tuple[str, str]:
    """The group and the name of the row to which a line of a file belongs."""
    if "stages" in line:
        return line["model"], line["stages"]
    return line["setting"], line.get("model") or line["planner"]


@pytest.fixture(scope="module", params=RATE_TABLES)
def made(request, published_like) -> Table:
    results = published_like(request.param)
    return make_table(request.param, RunData.of([("run", results)]), published=True)


def position(table: Table, row: Row) -> tuple[str, str]:
    """The setting, or the policy in the table of contexts, and the name of a row."""
    name = row.name.removesuffix(TWIN_MARK)
    return (name, row.group) if table.key == "planner" else (row.group, name)


def rows_of(table: Table, source: str) -> dict[tuple[str, str], dict[str, object]]:
    return {
        position(table, row): dict(
            zip((column.name for column in table.columns), row.entries, strict=True)
        )
        for row in table.rows
        if row.source == source
    }


def test_every_rate_and_average_is_the_published_one(made: Table) -> None:
    ours = rows_of(made, "ours")
    lines = printed(made.key)
    assert {place(line) for line in lines} == set(ours)
    for line in lines:
        entry = ours[place(line)][line["task"]]
        text = line["success_rate_percent"]
        expected = f"{float(text):.2f}" if text else "–"
        assert (line, entry.text, entry.marks) == (line, expected, "")


def test_every_change_is_that_of_the_published_rates(made: Table) -> None:
    """Computed anew from the file: floats, no code of the package."""
    rates = {
        (place(line), line["task"]): float(line["success_rate_percent"])
        for line in printed(made.key)
        if line["success_rate_percent"]
    }
    arrows = 0
    for (group, name), entries in rows_of(made, "ours").items():
        reference = (group, "1,5") if made.key == "context" else ("explicit", name)
        for column, entry in entries.items():
            if ((group, name), column) not in rates:
                continue  # suites, and what does not apply
            there, here = rates.get((reference, column)), rates[(group, name), column]
            if column == "Avg":
                applying = [
                    task for task in published_tasks(made.key) if ((group, name), task) in rates
                ]
                of_same = [rates[reference, task] for task in applying]
                there = round(sum(of_same) / len(of_same) + 1e-9, 2)
            expected = None if reference == (group, name) else round(here - there, 2)
            change = None if entry.change is None else float(entry.change)
            assert (group, name, column, change) == (group, name, column, expected)
            arrows += entry.change is not None
    references = {"main": 60, "planner": 8, "context": 12, "real": 6}[made.key]
    total = sum(bool(line["success_rate_percent"]) for line in printed(made.key))
    assert arrows == total - references


def test_our_rows_and_the_published_ones_are_drawn_alike(made: Table) -> None:
    """Numbers, arrows, dashes and what is bold."""

    def shown(row: Row) -> list[tuple[object, ...]]:
        return [(entry.text, entry.change, entry.best) for entry in row.entries]

    ours = {position(made, row): shown(row) for row in made.rows if row.source == "ours"}
    theirs = {position(made, row): shown(row) for row in made.rows if row.source == "published"}
    assert ours == theirs


@pytest.mark.parametrize(
    ("table", "model", "names", "texts"),
    [
        # Typed, and the arrows found, by hand: BinFill, PickXtimes, SwingXtimes, average.
        ("context", "FrameS-Modul", "✓ |  |  |  | ✓", ["24.00", "15.33", "48.00", "29.11"]),
        (
            "context",
            "FrameS-Modul",
            "✓ | ✓ |  |  | ✓",
            ["30.67 ↑6.67", "15.33 →0.00", "44.67 ↓3.33", "30.22 ↑1.11"],
        ),
        (
            "planner",
            "QwenVL",
            "direct",
            ["55.33 →0.00", "85.33 ↓2.67", "8.00 ↑4.00", "49.55 ↑0.44"],
        ),
        (
            "planner",
            "Gemini-3.1-Pro",
            "contextual",
            ["58.67 ↓5.33", "50.67 ↓1.33", "44.67 ↓5.33", "51.34 ↓3.99"],
        ),
    ],
)
def test_some_rows_by_hand(published_like, table, model, names, texts) -> None:
    made = make_table(table, RunData.of([("run", published_like(table, model))]))
    markdown = FORMATS["markdown"].draw(made).replace("*", "")
    assert f"| {names} | {' | '.join(texts)} |" in markdown


def test_spatial_averages_are_compared_on_equal_tasks_and_the_papers_changes_noted() -> None:
    table = make_table("main", None, published=True)
    notes = " ".join(table.notes)
    assert "Averages of spatial are over the 7 of 11 tasks" in notes
    assert (
        "pi0.5 ↓10.35, TTT-Expert ↓7.38, FrameS-Modul ↓25.92, GroundSG-QwenVL ↓11.70, MemER ↓16.62."
    ) in notes
    changes = [row.entries[-1].change for row in table.rows if row.group == "spatial"]
    assert list(map(str, changes)) == ["-14.48", "-10.86", "-26.48", "-17.91", "-29.04"]
    assert "over the" not in " ".join(make_table("planner", None, published=True).notes)


def test_against_which_average_spatial_is_compared_turns_no_arrow_of_the_paper() -> None:
    """Explicit over the same 7 tasks, as here, or over all 11."""
    explicit = {
        row.model: row for row in published_rows("main") if row.options.setting == "explicit"
    }
    for row in published_rows("main"):
        if row.options.setting == "spatial":
            same = [
                explicit[row.model].rates[task]
                for task, rate in row.rates.items()
                if rate is not None
            ]
            assert row.average < mean_percent(same)
            assert row.average < explicit[row.model].average


def test_published_averages_are_means_of_the_printed_rates() -> None:
    """And which ones would differ if the unrounded rates were averaged."""
    differing = []
    for table in RATE_TABLES:
        trials = TRIALS[table][0] * TRIALS[table][1]
        for row in published_rows(table):
            rates = [rate for rate in row.rates.values() if rate is not None]
            assert (row, mean_percent(rates)) == (row, row.average)
            exact = [Fraction(round(Fraction(rate) * trials / 100), trials) for rate in rates]
            if percent(sum(exact, Fraction(0)) / len(exact)) != row.average:
                differing.append((table, row.average))
    assert differing == [
        ("planner", Decimal("49.55")),
        ("planner", Decimal("15.55")),
        ("planner", Decimal("51.34")),
        ("context", Decimal("26.45")),
        ("context", Decimal("43.55")),
        ("context", Decimal("34.66")),
    ]


def test_every_published_rate_is_a_number_of_trials() -> None:
    """All are multiples of 1/150 (real world: 1/10), rounded half up: none needs an exception."""
    count = 0
    for table in RATE_TABLES:
        trials = TRIALS[table][0] * TRIALS[table][1]
        for row in published_rows(table):
            for rate in row.rates.values():
                if rate is not None:
                    successes = round(Fraction(rate) * trials / 100)
                    assert percent(Fraction(successes, trials)) == rate
                    count += 1
    assert count == 255 + 30 + 36 + 20


def test_the_tables_agree_where_they_show_the_same() -> None:
    main = {(row.model, row.options): row.rates for row in published_rows("main")}
    for row in published_rows("context"):
        if row.options.stages == STAGE_SETS[-1]:
            rates = main[row.model, row.options]
            assert row.rates == {task: rates[task] for task in row.rates}
    for row in published_rows("planner"):
        if row.model == "QwenVL":
            rates = main["GroundSG-QwenVL", row.options]
            assert row.rates == {task: rates[task] for task in row.rates}


def test_published_tables_fit_this_benchmark() -> None:
    assert set(published_tasks("main")) == set(all_tasks())
    for row in published_rows("main"):
        for task, rate in row.rates.items():
            assert (rate is not None) == (row.options.setting in settings_of(all_tasks()[task]))
    assert [row.options.stages for row in published_rows("context")[:4]] == list(STAGE_SETS)
    with pytest.raises(UnknownNameError, match="main, planner, context, real"):
        published_rows("mian")


def test_the_coverage_of_this_benchmark_is_read_off_its_tasks() -> None:
    table = make_table("coverage", None)
    published = published_coverage()
    assert len(table.rows) == len(published) == 14
    for row, theirs in zip(table.rows, published, strict=True):
        words = tuple(entry.word for entry in row.entries)
        assert (row.group, row.name, words) == (
            theirs.kind,
            theirs.benchmark,
            tuple(theirs.covers.values()),
        )
    assert [row.name for row in table.rows if row.source == "ours"] == ["RoboIRGBench"]


@pytest.mark.parametrize(
    ("which", "said"),
    [
        ("main", ("±8 points", "MemER 16.62 and 29.04", "pi0.5 10.35 and 14.48")),
        ("context", ("±8 points", "in 8 of 9 cells, by up to 14.00 points")),
        ("real", ("±26 points",)),
    ],
)
def test_notes_name_what_would_mislead(which, said):
    notes = " ".join(make_table(which, None, published=True).notes)
    for words in said:
        assert words in notes
    assert ("over fewer tasks" in notes) == (which == "main")
