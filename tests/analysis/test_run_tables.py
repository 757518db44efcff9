"""The terminal's table of a run, and the list of its failures."""

from __future__ import annotations

import io

import pytest
from flat_jobs import frame_of, make_result
from flat_jobs import make_results as play
from rich.console import Console

from roboirg.analysis.measures.breakdowns import BREAKDOWNS
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.frame import Frame
from roboirg.analysis.tables.diagnostic_tables import (
    diagnostic_tables,
    make_breakdown_table,
    make_failure_table,
)
from roboirg.analysis.tables.rendering import get_format
from roboirg.analysis.tables.rendering.terminal import print_tables
from roboirg.analysis.tables.run_tables import (
    failure_text,
    make_run_tables,
    print_failures,
)
from roboirg.records.record import Attribution, Summary
from roboirg.stats.rates import points


def printed(frame: Frame, width: int = 100) -> str:
    """Return what a finished run prints in a terminal: its tables and the list of failures."""
    console = Console(file=io.StringIO(), width=width)
    print_tables(make_run_tables(frame), console)
    print_failures(frame, console)
    return console.file.getvalue()


STORED_OUTPUT = """\
listener
┏━━━━━━━━━━━━━┳━━━━━━━━━━┳━━━━━━━━━━━━━━━━┳━━━━━━━━━━━━━━━━━━━┓
┃ task        ┃ explicit ┃         direct ┃ direct (resolved) ┃
┡━━━━━━━━━━━━━╇━━━━━━━━━━╇━━━━━━━━━━━━━━━━╇━━━━━━━━━━━━━━━━━━━┩
│ PickXtimes  │    100 ≠ │ 33 (−67) 1! 2… │          0 (−100) │
│ VideoUnmask │      0 ≠ │          0 (–) │                 – │
├─────────────┼──────────┼────────────────┼───────────────────┤
│ all tasks   │       50 │ 17 (−33) 1! 2… │          0 (−100) │
└─────────────┴──────────┴────────────────┴───────────────────┘
Played on the test split, in our own words, with at most 1300 steps. n = 1 to 4 episodes per cell, 1 to 6 episodes for 
all tasks, the mean over tasks
≠ not comparable with the published rate: our own words; 4 of 50 episodes (PickXtimes); 2 of 50 episodes (VideoUnmask).
listener has no headline number: no floors were measured for its language version 1.
success rate in %, in brackets the gap to explicit on the same episodes in points; (–) explicit has no success either, 
so the gap says nothing; ! episodes ended in an error and are left out of the rates; … episodes are still to be played
listener: 8 episodes without success
  PickXtimes test/0 direct (resolved) (policy seed 2): LONG
  PickXtimes test/1 direct: LONG
  PickXtimes test/2 direct: LONG
  PickXtimes test/3 direct: LONG !
  VideoUnmask test/0 explicit: LONG
  VideoUnmask test/0 direct: LONG
  VideoUnmask test/1 explicit: LONG
  VideoUnmask test/1 direct: LONG
"""  # noqa: E501, W291
LONG_CAUSE = "picked up the green cube [1]; expected: pick up the red cube for the first time"


def test_a_finished_run_prints_its_rates_gaps_missing_episodes_and_failures():
    """Letters are episodes: 1 won, 0 lost, ! an error. Direct wins 1 of 3 and 0 of 2 in two tasks.

    Their mean is 17 %, a gap of -33 to explicit on the same episodes. Would find 20 %, 1 of 5.
    """
    frame = frame_of(
        play("1111"),
        play("100!", "direct", cause=LONG_CAUSE),
        play("0", "direct", form="resolved", policy_seed=2, cause=LONG_CAUSE),
        play("00", task="VideoUnmask", cause=LONG_CAUSE),
        play("00", "direct", task="VideoUnmask", cause=LONG_CAUSE),
        planned=[result.identity for result in play("111111", "direct")],
    )
    assert printed(frame) == STORED_OUTPUT.replace("LONG", LONG_CAUSE)


ONE_FAILURE_OF_EACH_KIND = [
    Attribution(kind=kind, failure=failure, step=1, sentence="So.")
    for kind, failure in (
        ("grounding", "wrong_count"),
        ("execution", "dropped"),
        ("undecided", "stopped"),
    )
]
"""A failure of each kind."""
FRAME_WITH_OTHER_NUMBERS_IN_EVERY_CELL = frame_of(
    play("110100!111", prompt_verdict="heard", difficulty="hard"),
    play(
        "10001!1001",
        "direct",
        prompt_verdict="cut",
        attribution=ONE_FAILURE_OF_EACH_KIND[0],
        difficulty="hard",
    ),
    play("0110111111", "direct", form="resolved", prompt_verdict="heard"),
    play("1011", task="BinFill", prompt_verdict="heard"),
    play(
        "0010",
        "direct",
        task="BinFill",
        prompt_verdict="unknown",
        attribution=ONE_FAILURE_OF_EACH_KIND[1],
    ),
    play("0110", "direct", task="BinFill", form="resolved", prompt_verdict="cut"),
    play(
        "0001",
        "direct",
        task="VideoUnmask",
        prompt_verdict="heard",
        attribution=ONE_FAILURE_OF_EACH_KIND[1],
    ),
    play("0111", "direct", task="VideoUnmask", form="resolved", prompt_verdict="heard"),
    play("0", policy="other", attribution=ONE_FAILURE_OF_EACH_KIND[1]),
    play("0", "direct", policy="other", attribution=ONE_FAILURE_OF_EACH_KIND[1]),
)
"""Other numbers of everything in every cell."""


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("forms", "markdown"),
        ("failures", "markdown"),
        ("failure-names", "markdown"),
        ("heard", "markdown"),
        ("heard", "csv"),
    ],
)
def test_other_tables_are_as_stored(snapshot, name, kind):
    """Would find numbers of one row, column, form or outcome in place of another."""
    data = RunData(FRAME_WITH_OTHER_NUMBERS_IN_EVERY_CELL)

    table = diagnostic_tables()[name].make(data)

    assert get_format(kind).draw(table) == snapshot


def results_that_ended(kinds: str, setting: str) -> list[Summary]:
    """Return a result for each letter of how an episode ended.

    s success, ! error; failures: g grounding, x execution, u undecided, - without attribution.
    """
    wrong: dict[str, Attribution] = dict(zip("gxu", ONE_FAILURE_OF_EACH_KIND, strict=True))
    outcomes = {"s": "success", "!": "error"}
    found = []
    for episode, letter in enumerate(kinds):
        outcome = outcomes.get(letter, "failure")
        result = make_result(outcome, episode, setting=setting, attribution=wrong.get(letter))
        found.append(result)
    return found


@pytest.mark.parametrize(
    ("explicit", "direct", "rates", "changes", "shares"),
    [
        ("ssssssssgx", "sssssgggxu", "50 30 10 10", "−30 +20 ±0 +10", "60–80 50"),
        ("ssssssssgx", "sssssggg-u", "50 30 0 20", "−30 +20 −10 +20", "60–100 50"),
        ("ggggggxxuu", "ssssssssxx", "80 0 20 0", "+80 −60 ±0 −20", "0 60–80"),
        ("gg!sssxxss", "x!ssssssss", "89 0 11 0", "+25 −12 −12 ±0", "0 50"),
        ("ssssssssss", "sssssssssg", "90 10 0 0", "−10 +10 ±0 ±0", "100 –"),
    ],
)
def test_success_and_three_kinds_of_failure_add_up_to_100_and_their_changes_to_0(
    explicit, direct, rates, changes, shares
):
    """A letter is how an episode ended: s success, g grounding, x execution, u or - undecided.

    Rates of direct, and their changes from explicit, are of success, grounding, execution and
    undecided; shares are those of grounding among the failures of direct and of explicit. Changes
    are over the same episodes: in the fourth case, errors (!) leave eight of ten.
    """
    results = [*results_that_ended(explicit, "explicit"), *results_that_ended(direct, "direct")]

    _, row = make_failure_table(RunData(frame_of(results))).rows

    assert [f"{entry.percent:.0f}" for entry in row.entries[2:6]] == rates.split()
    found = [entry.text.split(".")[0] for entry in row.entries[6:10]]
    assert found == changes.split()
    assert [entry.text for entry in row.entries[10:]] == shares.split()


def test_a_failure_whose_name_this_version_does_not_know_counts_as_not_attributed():
    """A record of another version calls it "renamed"; would find it lost, or a crash."""
    other = Attribution(kind="execution", failure="renamed", sentence="So.")
    data = RunData(frame_of(play("10", attribution=other)))

    (row,) = diagnostic_tables()["failure-names"].make(data).rows

    assert [entry.text for entry in row.entries] == ["2", "1", "1"]


def test_the_breakdown_by_difficulty_is_as_stored(snapshot):
    table = make_breakdown_table(BREAKDOWNS["difficulty"], FRAME_WITH_OTHER_NUMBERS_IN_EVERY_CELL)
    assert get_format("markdown").draw(table) == snapshot


def test_the_first_ten_failures_are_listed_and_the_others_counted():
    lines = printed(frame_of(play("0" * 13, cause="late"))).splitlines()

    assert [line.split()[1] for line in lines[-11:-1]] == [f"test/{index}" for index in range(10)]
    assert lines[-1] == "  and 3 more"


def test_a_run_without_failures_has_no_list_of_them():
    assert "without success" not in printed(frame_of(play("1")))


def test_the_legend_explains_only_what_the_table_has():
    """Here privileged policies, and neither gaps nor errors."""
    text = printed(frame_of(play("0", privileged=True, cause="late")))

    assert "success rate in %; privileged policies and scripted hands use the simulator's" in text


def test_a_failure_without_instruction_is_listed_with_its_control_arm():
    (silent,) = play("0", arm="silent", cause="late", wordings="mine@1a")

    assert failure_text(silent) == "PickXtimes test/0 explicit (silent): late"


@pytest.mark.parametrize(
    ("outcomes", "style"), [("1110", "green"), ("110", "yellow"), ("100", "red")]
)
def test_a_rate_is_green_from_75_percent_and_red_below_50(outcomes, style):
    """3 of 4, 2 of 3 and 1 of 3 are won."""
    (table,) = make_run_tables(frame_of(play(outcomes)))

    assert table.rows[0].entries[0].style == style


@pytest.mark.parametrize("names", [["listener", "random"], ["random", "listener"]])
def test_policies_have_tables_in_the_order_of_the_plan(names):
    """The last table has the legend, whichever it is."""
    results = [*play("1"), *play("1", policy="random", privileged=True)]
    planned = [make_result(policy=name).identity for name in names]

    tables = make_run_tables(frame_of(results, planned=planned))

    assert [table.title.split(" ")[0] for table in tables] == names
    assert "privileged policies" in tables[-1].notes[-1]


def test_each_policy_split_step_limit_and_robot_has_a_table():
    results = [
        *play("1"),
        *play("1", split="val"),
        *play("1", max_steps=200),
        *play("1", policy="random", privileged=True),
        *play("1", robot="Panda"),
    ]

    tables = make_run_tables(frame_of(results))

    assert sorted(table.title for table in tables) == [
        "listener, split test, max steps 1300",
        "listener, split test, max steps 1300, on Panda",
        "listener, split test, max steps 200",
        "listener, split val, max steps 1300",
        "random, split test, max steps 1300 (privileged)",
    ]


@pytest.mark.parametrize(
    ("gap", "decimals", "text"),
    [
        (-0.5, 0, "−50"),
        (0.25, 0, "+25"),
        (0.0, 0, "±0"),
        (-0.001, 0, "±0"),
        (-0.5, 1, "−50.0"),
        (0.0004, 1, "±0.0"),
        (0.0006, 1, "+0.1"),
    ],
)
def test_a_gap_is_printed_in_points_with_its_sign(gap, decimals, text):
    """-0.5 is −50 points. What rounds to zero is ±0, with no sign of its own."""
    assert points(gap, decimals) == text
