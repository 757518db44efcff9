"""Tables mark incomplete cells, errors, single policies and several versions."""

from __future__ import annotations

import csv
import io
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import pytest
from flat_jobs import frame_of, make_result, make_results, with_version
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from roboirg.analysis.measures.chance import CHANCE
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.tables.paper_tables import WHICH, is_informative, make_table
from roboirg.analysis.tables.rendering import get_format
from roboirg.analysis.tables.rendering.terminal import renderable
from roboirg.language.settings import settings_of
from roboirg.stats.rates import mean_percent, percent
from roboirg.tasks import all_tasks


@given(st.integers(1, 5000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_a_rate_is_rounded_half_up_to_two_decimals(counts):
    """As the paper's; would find 0.125 printed as 0.12, or rounding that is done twice."""
    rate = Fraction(*counts)

    printed = percent(rate)

    assert Fraction(-1, 200) < Fraction(printed) - 100 * rate <= Fraction(1, 200)
    assert str(printed)[-3] == "."


def test_the_mean_of_printed_rates_is_rounded_half_up_too():
    assert mean_percent([Decimal("12.34"), Decimal("12.35")]) == Decimal("12.35")


STORED_TABLE = Path(__file__).with_name("printed_main_table.md")


def entries_of_row(table, group, name=None, source="ours"):
    """Return the entries of the only such row by column; without a name, that of any policy."""
    (row,) = [
        row
        for row in table.rows
        if row.group == group and row.source == source and name in (None, row.name)
    ]
    return dict(zip((column.name for column in table.columns), row.entries, strict=True))


def results_of_all_tasks(policy="a", settings=("explicit", "direct"), **fields):
    """Return two episodes of every task that has the setting, the first won, the second lost."""
    found = []
    for name, task in all_tasks().items():
        for setting in settings:
            if setting in settings_of(task):
                own = {"policy": policy, "task": name, "setting": setting, **fields}
                found.append(make_result("success", 0, **own))
                found.append(make_result("failure", 1, **own))
    return found


def table_of(which, *results, planned=(), **options):
    return make_table(which, RunData(frame_of(*results, planned=planned)), **options)


@pytest.mark.parametrize(
    ("explicit", "direct", "entry_of_explicit", "entry_of_direct"),
    [
        ("10", "11", "50.00", "100.00 ↑50.00"),
        ("10", "11!", "50.00", "100.00 !"),
        ("1", "11", "100.00 …", "100.00"),
    ],
    ids=["all were played", "an error", "an episode of explicit is still to be played"],
)
def test_a_rate_with_errors_or_missing_episodes_is_marked_and_has_no_change_to_explicit(
    explicit, direct, entry_of_explicit, entry_of_direct
):
    """A letter is an episode of BinFill: 1 won, 0 lost, ! an error.

    Two episodes are planned in explicit, 0 and 1. If one of them is missing, or one in direct is an
    error, the rates are not over the same episodes, and their difference would mislead.
    """
    planned = [result.identity for result in make_results("11", "explicit", task="BinFill")]
    results = [
        *make_results(explicit, "explicit", task="BinFill"),
        *make_results(direct, "direct", task="BinFill"),
    ]

    table = table_of("main", results, planned=planned)

    assert str(entries_of_row(table, "explicit")["BinFill"]) == entry_of_explicit
    assert str(entries_of_row(table, "direct")["BinFill"]) == entry_of_direct


def test_the_main_table_of_two_policies_with_chance_is_as_stored():
    """*good* played two episodes of every task in two settings, the first was won.

    *poor* played BinFill, with an error in spatial; an episode of StopCube is planned. Below the
    table stands what is not in it: results of another task, and of resolved instructions.
    """
    good = results_of_all_tasks("good", ("explicit", "spatial"), split="val")
    of_poor = {"policy": "poor", "split": "val"}
    poor = [
        *make_results("11", "explicit", task="BinFill", **of_poor),
        *make_results("10!", "spatial", task="BinFill", **of_poor),
        *make_results("0", "direct", task="BinFill", form="resolved", **of_poor),
        *make_results("0", "explicit", task="Other", **of_poor),
    ]
    unplayed = make_result(task="StopCube", **of_poor).identity

    table = table_of("main", good, poor, planned=[unplayed], floors=(CHANCE,))

    assert get_format("markdown").draw(table) == STORED_TABLE.read_text("utf-8")


def test_each_split_has_its_own_row_of_chance():
    """Chance is a guess among the goals that the command leaves open; a mean would hide the split.

    In episode 0 of VideoUnmask on the test split, "the first one's" means one of two cubes that
    were named: 1 / 2. In that of the val split, "it" may be any of three cubes: 1 / 3.
    """
    test = make_results("1", "direct", split="test", task="VideoUnmask")
    val = make_results("1", "direct", split="val", task="VideoUnmask")

    table = table_of("main", test, val, floors=["chance"])

    of_test = entries_of_row(table, "direct", "chance, split test", source="chance")
    of_val = entries_of_row(table, "direct", "chance, split val", source="chance")
    assert str(of_test["VideoUnmask"]) == "50.00"
    assert str(of_val["VideoUnmask"]) == "33.33"


def informative_tables(*results):
    """Return the names of the tables that are shown if none is asked for."""
    data = RunData(frame_of(*results))
    return {name for name in WHICH if is_informative(name, data)}


@pytest.mark.parametrize(
    ("results", "tables"),
    [
        ([make_result(task="PutInBox")], {"real"}),
        ([make_result(task="Outside")], {"other"}),
        (results_of_all_tasks(), {"main"}),
        (results_of_all_tasks(settings=("explicit", "contextual")), {"main"}),
        ([make_result(arm="silent"), *results_of_all_tasks()], {"main"}),
        (
            [
                *results_of_all_tasks(settings=("contextual",)),
                *results_of_all_tasks(settings=("contextual",), stages=(1, 5)),
            ],
            {"main", "context"},
        ),
    ],
    ids=[
        "task of the real robot",
        "task of another package",
        "a policy",
        "a length",
        "a control arm",
        "two lengths of the context",
    ],
)
def test_tables_without_a_choice_are_those_for_which_a_run_has_something_to_compare(
    results, tables
):
    assert informative_tables(results) == tables


def test_the_table_of_planners_is_shown_if_a_planner_stands_next_to_another_policy():
    """A planner is known by its version, which names the hands that carry out its subgoals.

    Policies without a planner, or a single planner, have only the main table.
    """
    policies = [*results_of_all_tasks("a"), *results_of_all_tasks("b")]
    planners = [
        with_version(result, "planner + scripted hands") for result in results_of_all_tasks("a")
    ]

    assert informative_tables(policies) == {"main"}
    assert informative_tables(planners) == {"main"}
    assert informative_tables(planners, policies) == {"main", "planner"}


def drawn_table(table, width, *, in_terminal):
    """Return a table as it is drawn in so many characters, in a terminal or into a file."""
    console = Console(
        file=io.StringIO(), width=width, force_terminal=in_terminal, color_system=None
    )
    console.print(renderable(table, console))
    return console.file.getvalue()


@pytest.mark.parametrize(("width", "parts"), [(400, 1), (120, 3), (72, 6), (45, 15)])
def test_a_table_wider_than_the_terminal_is_drawn_in_parts_without_losing_a_rate(width, parts):
    """Of two episodes of each task and setting one is won: all rates and averages are 50.00.

    The table has two rows, explicit and direct, and some 250 characters. What does not fit goes to
    further parts, each with the title; the names of rows take most of a narrow one. Nothing is cut
    off (…).
    """
    table = table_of("main", results_of_all_tasks())

    text = drawn_table(table, width, in_terminal=True)

    assert text.count("Success by task and setting") == parts
    assert text.count("50.00") == 2 * len(table.columns)
    assert "…" not in text


@pytest.mark.parametrize("width", [200, 60])
def test_a_long_name_is_folded_in_a_terminal_and_whole_in_a_file(width):
    """The policy's name is 150 times Q, a letter that stands nowhere else in the table.

    It stands in two rows (settings) of each part of the table, of which each has a title, and in a
    note below. If it is folded without losing a letter, the terminal has as many times 150.
    """
    table = table_of("main", results_of_all_tasks(policy="Q" * 150))

    folded = drawn_table(table, width, in_terminal=True)
    written = drawn_table(table, width, in_terminal=False)

    parts = folded.count("Success by task and setting")
    assert folded.count("Q") == 150 * (2 * parts + 1)
    assert "Q" * 150 in written
    assert "…" not in folded + written


def test_a_task_of_which_nothing_was_played_has_no_column_in_the_terminal():
    """Two episodes of PickXtimes were played; the terminal is wide enough for all columns."""
    console = Console(file=io.StringIO(), width=400)
    explicit = make_results("10", policy="a", task="PickXtimes")
    direct = make_results("10", "direct", policy="a", task="PickXtimes")

    console.print(renderable(table_of("main", explicit, direct), console))

    drawn = console.file.getvalue()
    assert "PickXtimes" in drawn
    assert "StopCube" not in drawn


def test_csv_has_a_line_for_each_rate_with_the_counts_behind_it():
    """Of three episodes of BinFill one is won, one lost, and one an error."""
    error = make_results("--!", "direct", policy="a", task="BinFill")
    table = table_of("main", results_of_all_tasks(), error)

    lines = list(csv.DictReader(io.StringIO(get_format("csv").draw(table))))

    assert len(lines) == sum(len(row.entries) for row in table.rows)
    (line,) = [line for line in lines if (line["group"], line["column"]) == ("direct", "BinFill")]
    counts = {"successes": "1", "trials": "2", "episodes": "2", "errors": "1", "missing": "0"}
    assert line.items() >= {"incomplete": "errors", **counts}.items()


def test_a_task_that_the_paper_lacks_has_a_table_of_its_own():
    """Its only episode is won with both instructions: a rate of 100, which changed by 0."""
    explicit = make_results("1", policy="a", task="Outside")
    direct = make_results("1", "direct", policy="a", task="Outside")
    tasks_of_the_paper = results_of_all_tasks()

    table = table_of("other", tasks_of_the_paper, explicit, direct, published=True)

    rates = {column: str(entry) for column, entry in entries_of_row(table, "direct").items()}
    assert rates == {"Outside": "100.00 →0.00", "Avg": "100.00 →0.00"}


def test_a_task_that_the_paper_lacks_is_not_in_the_papers_table():
    """The policy also played the task *Outside*; the main table is the same without it."""
    outside = make_results("1", policy="a", task="Outside")

    with_it = table_of("main", results_of_all_tasks(), outside)

    assert with_it.rows == table_of("main", results_of_all_tasks()).rows


def test_results_in_simulation_are_marked_and_kept_apart_from_those_of_a_real_robot():
    """PutInBox is a task of the real study; its simulated copy is called the twin."""
    simulated = make_result("success", task="PutInBox", privileged=True)
    real = make_result("failure", task="PutInBox", privileged=True, robot="a robot")

    table = table_of("real", [simulated], [real], published=True)

    rates = {row.name: row.entries[0].text for row in table.rows if row.source == "ours"}
    assert rates == {
        "listener (privileged) (twin)": "100.00",
        "listener, on a robot (privileged)": "0.00",
    }
    assert "(twin): the study's twin, in simulation" in " ".join(table.notes)


def test_the_note_on_averages_counts_the_tasks_of_the_run_next_to_published_rows():
    """Two tasks were played, and one of them has no spatial setting; the paper has 7 of 11."""
    results = [
        *make_results("10", "explicit", task="StopCube"),
        *make_results("10", "explicit", task="PickXtimes"),
        *make_results("10", "spatial", task="PickXtimes"),
    ]

    notes = table_of("main", results, published=True).notes

    (note,) = [note for note in notes if note.startswith("Averages of spatial")]
    assert "over the 1 of 2 tasks that have it" in note


@pytest.mark.parametrize(
    "difference",
    [{"split": "val"}, {"max_steps": 900}, {"language_version": "2"}, {"episode": 5}],
    ids=["split", "step limit", "language", "episodes"],
)
def test_no_rate_is_bold_against_one_of_another_split_limit_version_or_other_episodes(difference):
    """A policy wins both episodes (1), another one loses its only episode under other conditions.

    Bold is the best of rates that can be compared; ** is bold in Markdown.
    """
    good = make_results("11", policy="good")
    other = [make_result("failure", policy="poor", **difference)]

    assert "**" not in get_format("markdown").draw(table_of("main", good, other))


def test_the_best_rate_of_the_same_episodes_is_bold():
    """One policy wins episodes 0 and 1, the other loses both; ** is bold in Markdown."""
    good = make_results("11", policy="good")
    poor = make_results("00", policy="poor")

    assert "**100.00**" in get_format("markdown").draw(table_of("main", good, poor))
