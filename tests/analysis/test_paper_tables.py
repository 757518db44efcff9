"""Tables mark incomplete cells, errors, single policies and several versions."""

from __future__ import annotations

import csv
import io
import re
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import pytest
from flat_jobs import with_version
from hypothesis import given
from hypothesis import strategies as st
from made_records import make_record
from msgspec.structs import replace
from rich.console import Console

from roboirg.core.errors import UnknownNameError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.stats.cells import gather
from roboirg.evaluation.analysis.stats.chance import CHANCE, FLOORS
from roboirg.evaluation.analysis.stats.measured_floors import LEARNED
from roboirg.evaluation.analysis.stats.rates import change_text, mean_percent, percent
from roboirg.evaluation.analysis.tables.paper_tables import is_informative, make_table
from roboirg.evaluation.analysis.tables.rendering import FORMATS, get_format
from roboirg.evaluation.analysis.tables.rendering.terminal import renderable
from roboirg.evaluation.analysis.tables.table import Entry
from roboirg.evaluation.records.record import Job, Record
from roboirg.evaluation.records.record_codec import encode, read_summary
from roboirg.policies.by_name.finding import read_policy
from roboirg.tasks import all_tasks


@given(st.integers(1, 5000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_rates_are_rounded_half_up_once(counts: tuple[int, int]) -> None:
    exact = 100 * Fraction(*counts)
    printed = Fraction(percent(Fraction(*counts)))
    assert Fraction(-1, 200) < printed - exact <= Fraction(1, 200)
    assert str(percent(Fraction(*counts)))[-3] == "."


def test_rounding_by_hand() -> None:
    assert percent(Fraction(1, 16)) == Decimal("6.25")
    assert percent(Fraction(1, 32)) == Decimal("3.13")  # 3.125
    assert mean_percent([Decimal("0.01"), Decimal("0.00")]) == Decimal("0.01")
    texts = [change_text(Decimal(one)) for one in ("1.33", "-0.67", "0.00", "-0.00")]
    assert texts == ["↑1.33", "↓0.67", "→0.00", "→0.00"]


def entries(table, group: str, name: str | None = None, source: str = "ours") -> dict[str, Entry]:
    (row,) = [
        row
        for row in table.rows
        if row.group == group and row.source == source and name in (None, row.name)
    ]
    return dict(zip((column.name for column in table.columns), row.entries, strict=True))


def whole(result, policy: str = "a", settings=("explicit", "direct"), **fields) -> list:
    """Two episodes of every task, the first won."""
    return [
        result(outcome, episode, policy=policy, task=task, setting=setting, **fields)
        for task in all_tasks()
        for setting in settings
        for episode, outcome in enumerate(("success", "failure"))
    ]


def notes(table) -> str:
    return " ".join(table.notes)


def test_a_complete_run_has_no_marks(result) -> None:
    table = make_table("main", gather([("run", whole(result))]))
    assert {entry.text for row in table.rows for entry in row.entries} == {"50.00"}
    assert not any(entry.marks for row in table.rows for entry in row.entries)
    assert {entry.change for entry in entries(table, "direct").values()} == {0}
    assert "Only one policy was played" in notes(table)
    assert "2 episodes per cell, each played once" in notes(table)
    assert "Bold" not in notes(table)


def test_an_error_marks_its_cell_and_every_average_over_it(result) -> None:
    results = [*whole(result), result("error", 2, policy="a", task="BinFill", setting="direct")]
    table = make_table("main", gather([("run", results)]))
    direct = entries(table, "direct")
    assert {name for name, entry in direct.items() if entry.marks} == {
        "BinFill",
        "Counting Avg",
        "Avg",
    }
    assert (direct["BinFill"].text, direct["BinFill"].marks) == ("50.00", "!")
    assert {direct[name].marks for name in ("Counting Avg", "Avg")} == {"*"}
    assert {direct[name].change for name in ("BinFill", "Counting Avg", "Avg")} == {None}
    assert direct["StopCube"].change == 0
    assert "! 1 trial ended in an error" in notes(table)


def test_what_is_missing_is_marked_and_compared_with_nothing(result) -> None:
    results = whole(result)
    planned = [one.identity for one in results]
    gone = [one for one in results if (one.task, one.options.setting) != ("StopCube", "explicit")]
    table = make_table("main", gather([("run", gone)], planned))
    assert (
        entries(table, "explicit")["StopCube"].text,
        entries(table, "explicit")["StopCube"].marks,
    ) == ("", "…")
    assert entries(table, "direct")["StopCube"].change is None
    assert entries(table, "direct")["Avg"].change is None
    assert "… 2 trials of the plan are still to be played" in notes(table)


def test_a_task_that_was_not_played_leaves_a_gap_and_marks_the_average(result) -> None:
    results = [one for one in whole(result) if one.task != "BinFill"]
    table = make_table("main", gather([("run", results)]))
    assert entries(table, "direct")["BinFill"] == Entry()
    assert entries(table, "direct")["Avg"].marks == "*"
    assert entries(table, "direct")["Permanence Avg"].marks == ""


def test_the_best_is_bold_among_complete_cells_only(result) -> None:
    good, poor = whole(result, "good"), whole(result, "poor")
    good = [replace(one, outcome="success") if one.task == "BinFill" else one for one in good]
    table = make_table("main", gather([("run", [*good, *poor])]))
    assert entries(table, "direct", "good")["BinFill"].best
    assert not entries(table, "direct", "poor")["BinFill"].best
    assert not entries(table, "direct", "good")["StopCube"].best  # all have the same
    assert "One policy" not in notes(table)
    poor.append(result("error", 2, policy="poor", task="BinFill", setting="direct"))
    table = make_table("main", gather([("run", [*good, *poor])]))
    assert not entries(table, "direct", "good")["BinFill"].best
    assert entries(table, "explicit", "good")["BinFill"].best


def test_versions_stand_apart_and_are_named(result) -> None:
    results = [
        *whole(result, language_version="1"),
        *whole(result, language_version="2", policy_version="new"),
    ]
    table = make_table("main", gather([("run", results)]))
    assert len(table.rows) == 4
    assert {row.name for row in table.rows} == {
        "a, policy unknown, language 1",
        "a, policy new, language 2",
    }


def test_other_options_are_in_no_cell_and_named(result) -> None:
    results = [
        *whole(result),
        result("failure", 0, policy="a", task="BinFill", setting="direct", form="resolved"),
        result("failure", 0, policy="a", task="Other"),
    ]
    table = make_table("main", gather([("run", results)]))
    assert entries(table, "direct")["BinFill"].text == "50.00"
    assert "the results of Other" in notes(table)
    assert "direct (resolved)" in notes(table)


def test_only_informative_tables_are_wanted(result) -> None:
    cells = gather([("run", whole(result, settings=("explicit", "contextual")))])
    assert is_informative("main", cells)
    unwanted = ("coverage", "planner", "context", "real")
    assert not any(is_informative(one, cells) for one in unwanted)
    short = whole(result, settings=("contextual",), stages=(1, 5))
    both = gather([("run", [*whole(result, settings=("contextual",)), *short])])
    assert is_informative("context", both)
    two = [*whole(result), *whole(result, "b")]
    assert not is_informative("planner", gather([("run", two)]))
    two[0] = with_version(two[0], "planner + scripted hands")
    assert is_informative("planner", gather([("run", two)]))
    real = gather([("run", [result(task="PutInBox")])])
    assert is_informative("real", real)
    assert entries(make_table("real", real), "explicit")["Avg"].marks == "*"


def test_spatial_is_compared_with_explicit_on_the_tasks_that_have_it(result) -> None:
    """Explicit is 50 % on those and 100 % on the others: no change, though its average is more."""
    results = whole(result, settings=("explicit",))
    results = [
        one if all_tasks()[one.task].spatial else replace(one, outcome="success") for one in results
    ]
    spatial = whole(result, settings=("spatial",))
    results += [one for one in spatial if all_tasks()[one.task].spatial]
    table = make_table("main", gather([("run", results)]))
    assert entries(table, "explicit")["Avg"].percent > Decimal(60)
    average = entries(table, "spatial")["Avg"]
    assert (average.text, average.change, average.marks) == ("50.00", 0, "")
    assert entries(table, "spatial")["Reference Avg"].text == "–"


def test_the_chance_level_stands_below(result) -> None:
    table = make_table("main", gather([("run", whole(result))]), floors=(CHANCE,))
    assert entries(table, "explicit", source="chance")["Avg"].text == "100.00"
    direct = entries(table, "direct", source="chance")
    assert direct["StopCube"].text == "25.00"
    assert direct["StopCube"].change is None


def test_the_floors_stand_below_the_chance_level(result) -> None:
    cells = gather([("run", whole(result))])
    table = make_table("main", cells, floors=FLOORS)
    below = [(row.group, row.name) for row in table.rows if row.source == "chance"]
    names = ["chance", "first-mention", "last-mention", "elimination", "surface"]
    # Of explicit, which leaves nothing open, nothing is measured.
    named = {"explicit": names, "direct": [*names, *LEARNED]}
    assert below == [(setting, name) for setting, own in named.items() for name in own]
    by_name = {(row.group, row.name): row.entries[-1].text for row in table.rows}
    assert by_name["direct", "surface"] == "100.00"
    assert by_name["direct", "first-mention"] == "81.82"
    assert by_name["direct", "elimination"] == "4.04"
    assert [row for row in table.rows if row.source != "chance"] == list(
        make_table("main", cells).rows
    )


@pytest.mark.parametrize(("width", "parts"), [(400, 1), (120, 3), (72, 6), (45, 15)])
def test_a_wide_table_is_drawn_in_parts(result, width: int, parts: int) -> None:
    """And every rate is there, whatever the width."""
    table = make_table("main", gather([("run", whole(result))]))
    console = Console(file=io.StringIO(), width=width, force_terminal=True, color_system=None)
    console.print(renderable(table, console))
    text = console.file.getvalue()
    assert text.count("Success by task and setting") == parts
    assert text.count("50.00") == 2 * len(table.columns)
    assert all(f" {column.name} " in text for column in table.columns)


@pytest.mark.parametrize("width", [60, 80, 200])
def test_names_are_never_cut(result, width: int) -> None:
    """In files lines are as long as names need; in terminals names are folded."""
    name = "a_package.with_a_long_name.policies:" + "Net" * 40
    table = make_table("main", gather([("run", whole(result, name))]))
    for terminal in (False, True):
        console = Console(
            file=io.StringIO(), width=width, force_terminal=terminal, color_system=None
        )
        console.print(renderable(table, console))
        text = console.file.getvalue()
        assert name in (
            text if not terminal else re.sub(r"\d+\.\d+|[^\w.:]|explicit|direct", "", text)
        )
        assert "…" not in text
    assert name in FORMATS["terminal"].draw(table)


def test_csv_has_every_entry_with_its_counts(result) -> None:
    results = [*whole(result), result("error", 2, policy="a", task="BinFill", setting="direct")]
    table = make_table("main", gather([("run", results)]))
    lines = list(csv.DictReader(io.StringIO(FORMATS["csv"].draw(table))))
    assert len(lines) == sum(len(row.entries) for row in table.rows)
    (line,) = [one for one in lines if (one["group"], one["column"]) == ("direct", "BinFill")]
    assert line == {
        "table": "main", "source": "ours", "group": "direct", "name": "a", "column": "BinFill",
        "is_average": "no", "percent": "50.00", "word": "", "applies": "yes", "change": "",
        "best": "no", "incomplete": "errors", "successes": "1", "trials": "2", "episodes": "2",
        "errors": "1", "missing": "0", "low_percent": "9.45", "high_percent": "90.55",
        "comparable": "", "differences": "",
    }  # fmt: skip


def test_latex_is_balanced_and_markdown_rectangular(result) -> None:
    odd = "my_pkg:Net & 50% #1|{x}\\*"
    cells = gather([("run", [*whole(result, odd), *whole(result, "b", settings=("spatial",))])])
    table = make_table("main", cells, published=True)
    latex = FORMATS["latex"].draw(table)
    rows = [
        line for line in latex.splitlines() if line.endswith(r"\\") and "multicolumn" not in line
    ]
    # The averages of suites are left out.
    assert {line.replace(r"\&", "").count("&") for line in rows} == {len(all_tasks()) + 1}
    folded = latex.replace(r"\allowbreak{}", "")
    assert r"my\_pkg:Net \& 50\% \#1$|$\{x\}\textbackslash{}*" in folded
    unescaped = latex.replace(r"\{", "").replace(r"\}", "")
    assert unescaped.count("{") == unescaped.count("}")
    assert r"\textbf{93.33}" in latex
    assert "93.33" in latex
    assert " -- " in latex
    assert not set("↑↓→…–×≠") & set(latex)
    markdown = FORMATS["markdown"].draw(table)
    lines = [line for line in markdown.splitlines() if line.startswith("|")]
    assert {line.replace("\\|", "").count("|") for line in lines} == {len(table.columns) + 3}


def test_other_names_are_refused() -> None:
    with pytest.raises(UnknownNameError, match="terminal, markdown, latex, csv"):
        get_format("html")
    with pytest.raises(UnknownNameError, match="Did you mean 'main'"):
        make_table("mian", {})


def test_tasks_outside_the_paper_have_a_table_of_their_own(result) -> None:
    ours = whole(result)
    outside = [
        result(outcome, episode, policy="a", task="Outside", setting=setting)
        for setting in ("explicit", "direct")
        for episode, outcome in enumerate(("success", "failure"))
    ]
    cells = gather([("run", [*ours, *outside])])
    table = make_table("other", cells, published=True)
    assert [column.name for column in table.columns] == ["Outside", "Avg"]
    assert entries(table, "direct")["Outside"].percent == Decimal("50.00")
    assert is_informative("other", cells)
    assert not is_informative("other", gather([("run", ours)]))
    assert make_table("main", cells).rows == make_table("main", gather([("run", ours)])).rows


def test_results_of_the_twin_are_marked_and_kept_apart_from_a_robots(result) -> None:
    def played(robot: str | None, outcome: str) -> Record:
        job = Job(
            policy="listener",
            ref=read_policy("listener"),
            task="PutInBox",
            split="test",
            episode=0,
            options=InstructionOptions("explicit"),
        )
        cause = None if outcome == "success" else "missed"
        return make_record(job, outcome, cause, robot=robot)

    records = [played(None, "success"), played("a robot", "failure")]
    stored = [read_summary(encode(one), Path("r"), 1) for one in records]
    for results in (records, stored):
        table = make_table("real", gather([("run", results)]), published=True)
        ours = {row.name: row.entries[0].text for row in table.rows if row.source == "ours"}
        assert ours == {
            "listener (privileged) (twin)": "100.00",
            "listener, on a robot (privileged)": "0.00",
        }
        assert "(twin): the study's twin, in simulation" in notes(table)
