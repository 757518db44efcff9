"""The terminal's table of a run, and the list of its failures."""

from __future__ import annotations

import io

import pytest
from flat_jobs import frame_of, make_result, make_results
from rich.console import Console

from roboirg.analysis.measures.breakdowns import BREAKDOWNS
from roboirg.analysis.measures.run_data import RunData
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
from roboirg.records.record import Attribution


def printed(frame, width=100):
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
        make_results("1111"),
        make_results("100!", "direct", cause=LONG_CAUSE),
        make_results("0", "direct", form="resolved", policy_seed=2, cause=LONG_CAUSE),
        make_results("00", task="VideoUnmask", cause=LONG_CAUSE),
        make_results("00", "direct", task="VideoUnmask", cause=LONG_CAUSE),
        planned=[result.identity for result in make_results("111111", "direct")],
    )
    assert printed(frame) == STORED_OUTPUT.replace("LONG", LONG_CAUSE)


GROUNDING = Attribution(kind="grounding", failure="wrong_count", step=1, sentence="So.")
EXECUTION = Attribution(kind="execution", failure="dropped", step=1, sentence="So.")
UNDECIDED = Attribution(kind="undecided", failure="stopped", step=1, sentence="So.")

FRAME_WITH_OTHER_NUMBERS_IN_EVERY_CELL = frame_of(
    make_results("110100!111", prompt_verdict="heard", difficulty="hard"),
    make_results(
        "10001!1001", "direct", prompt_verdict="cut", attribution=GROUNDING, difficulty="hard"
    ),
    make_results("0110111111", "direct", form="resolved", prompt_verdict="heard"),
    make_results("1011", task="BinFill", prompt_verdict="heard"),
    make_results("0010", "direct", task="BinFill", prompt_verdict="unknown", attribution=EXECUTION),
    make_results("0110", "direct", task="BinFill", form="resolved", prompt_verdict="cut"),
    make_results(
        "0001", "direct", task="VideoUnmask", prompt_verdict="heard", attribution=EXECUTION
    ),
    make_results("0111", "direct", task="VideoUnmask", form="resolved", prompt_verdict="heard"),
    make_results("0", policy="other", attribution=EXECUTION),
    make_results("0", "direct", policy="other", attribution=EXECUTION),
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
    """Results of two policies and three tasks that put another number into each cell of a table.

    Would find numbers of one row, column, form or outcome in place of another.
    """
    data = RunData(FRAME_WITH_OTHER_NUMBERS_IN_EVERY_CELL)

    table = diagnostic_tables()[name].make(data)

    assert get_format(kind).draw(table) == snapshot


ENDINGS = {
    "success": ("success", None),
    "grounding": ("failure", GROUNDING),
    "execution": ("failure", EXECUTION),
    "undecided": ("failure", UNDECIDED),
    "unattributed": ("failure", None),
    "error": ("error", None),
}
"""How an episode can end: its outcome, and the kind of its failure."""


def line_of_failures(explicit, direct):
    """Return the line of *direct* in the table of failures: texts without intervals, by column.

    Both name the ending of each episode (`ENDINGS`), from episode 0 on.
    """
    results = []
    for setting, endings in (("explicit", explicit), ("direct", direct)):
        for episode, ending in enumerate(endings.split()):
            outcome, attribution = ENDINGS[ending]
            results.append(make_result(outcome, episode, setting=setting, attribution=attribution))
    table = make_failure_table(RunData(frame_of(results)))
    _, line = table.rows
    names = [column.name for column in table.columns]
    return dict(zip(names, [entry.text.split(" (")[0] for entry in line.entries], strict=True))


def test_success_and_three_kinds_of_failure_add_up_to_100_percent():
    """One of four episodes ends in each way, the last one in a failure without a known kind, which
    counts as undecided. Nothing fails in explicit, so no share of failures is known there."""
    line = line_of_failures("success", direct="success grounding execution unattributed")

    for kind in ("success", "grounding", "execution", "undecided"):
        assert line[kind] == "25.00", kind
    assert line["the same in explicit"] == "–"


def test_changes_of_success_and_of_three_kinds_of_failure_add_up_to_0():
    """Of four episodes, success falls from 3 to 1, which is -50 points; grounding rises from 0 to
    1, execution stays at 1, and undecided rises from 0 to 1."""
    explicit = "success success success execution"
    direct = "success grounding undecided execution"

    line = line_of_failures(explicit, direct)

    assert line["gap to explicit"] == "−50.0"
    assert line["grounding, change"] == line["undecided, change"] == "+25.0"
    assert line["execution, change"] == "±0.0"


def test_changes_are_of_the_episodes_that_have_no_error_in_either_setting():
    """The first two of six episodes have an error in one of the settings.

    In the other four, success rises from 1 to 2 and grounding falls from 2 to 1. The rate is of
    five episodes, three of them successes.
    """
    explicit = "error success grounding grounding execution success"
    direct = "success error success grounding execution success"

    line = line_of_failures(explicit, direct)

    assert line["success"] == "60.00"
    assert line["gap to explicit"] == "+25.0"
    assert line["grounding, change"] == "−25.0"


@pytest.mark.parametrize(
    ("failures", "share"),
    [
        ("grounding grounding grounding execution undecided", "60–80"),
        ("grounding grounding grounding unattributed undecided", "60–100"),
        ("execution", "0"),
        ("grounding", "100"),
    ],
)
def test_the_share_of_grounding_leaves_open_what_undecided_failures_are(failures, share):
    """At most all undecided ones are failures of grounding, too: 3 of five failures and 1 that is
    undecided are 60 to 80 %."""
    line = line_of_failures("success", direct=failures)

    assert line["grounding of failures"] == share


def test_the_share_of_grounding_in_explicit_stands_next_to_it():
    """Explicit names every object, so a failure of grounding there is not due to references."""
    line = line_of_failures(explicit="grounding execution", direct="success success")

    assert line["the same in explicit"] == "50"


def test_a_failure_whose_name_this_version_does_not_know_counts_as_not_attributed():
    """A record of another version calls it "renamed"; would find it lost, or a crash."""
    other = Attribution(kind="execution", failure="renamed", sentence="So.")
    data = RunData(frame_of(make_results("10", attribution=other)))

    (row,) = diagnostic_tables()["failure-names"].make(data).rows

    assert [entry.text for entry in row.entries] == ["2", "1", "1"]


def test_the_breakdown_by_difficulty_is_as_stored(snapshot):
    """The results put another number into each cell, so an exchange of two would be seen."""
    table = make_breakdown_table(BREAKDOWNS["difficulty"], FRAME_WITH_OTHER_NUMBERS_IN_EVERY_CELL)

    assert get_format("markdown").draw(table) == snapshot


def test_the_first_ten_failures_are_listed_and_the_others_counted():
    """13 episodes, 0 to 12, are lost (0). The last eleven lines are ten failures and a count.

    A line is such as "PickXtimes test/0 explicit: late", with the split and the episode.
    """
    lines = printed(frame_of(make_results("0000000000000", cause="late"))).splitlines()

    assert [line.split()[1] for line in lines[-11:-1]] == [
        "test/0", "test/1", "test/2", "test/3", "test/4",
        "test/5", "test/6", "test/7", "test/8", "test/9",
    ]  # fmt: skip
    assert lines[-1] == "  and 3 more"


def test_a_run_without_failures_has_no_list_of_them():
    assert "without success" not in printed(frame_of(make_results("1")))


def test_the_legend_explains_privileged_policies_if_there_are_any():
    """A policy that reads the simulator's state, or one that does not, loses an episode (0)."""
    legend = "success rate in %; privileged policies and scripted hands use the simulator's"

    assert legend in printed(frame_of(make_results("0", privileged=True)))
    assert "privileged" not in printed(frame_of(make_results("0")))


def test_a_failure_of_a_control_arm_is_listed_with_its_arm():
    """The episode was lost (0) in the arm *silent*, without words."""
    (silent,) = make_results("0", arm="silent", cause="late", wordings="mine@1a")

    assert failure_text(silent) == "PickXtimes test/0 explicit (silent): late"


@pytest.mark.parametrize(
    ("failure", "text"),
    [
        ("misunderstood", "late. Understood red, twice; meant green, once."),
        ("dropped", "late"),
    ],
)
def test_what_a_model_named_instead_of_the_goal_follows_the_cause_of_the_failure(failure, text):
    """Of a model that never answers, *not done after 1300 steps* is not the reason."""
    named = "Understood red, twice; meant green, once."
    attribution = Attribution(kind="grounding", failure=failure, sentence=named)
    (result,) = make_results("0", cause="late", attribution=attribution)

    assert failure_text(result) == f"PickXtimes test/0 explicit: {text}"


@pytest.mark.parametrize(
    ("outcomes", "color"), [("1110", "green"), ("110", "yellow"), ("100", "red")]
)
def test_a_rate_is_green_from_75_percent_and_red_below_50(outcomes, color):
    """Won (1) are 3 of 4 episodes, 2 of 3 and 1 of 3: 75, 67 and 33 %."""
    (table,) = make_run_tables(frame_of(make_results(outcomes)))

    assert table.rows[0].entries[0].style == color


def test_each_split_step_limit_and_robot_has_a_table_of_its_own():
    """The first episode is a usual one, on the test split and with a limit of 1300 steps.

    The others are on another split, with another limit, and on a real robot; all are won (1).
    """
    results = [
        *make_results("1"),
        *make_results("1", split="val"),
        *make_results("1", max_steps=200),
        *make_results("1", robot="Panda"),
    ]

    titles = [table.title for table in make_run_tables(frame_of(results))]

    assert sorted(titles) == [
        "listener, split test, max steps 1300",
        "listener, split test, max steps 1300, on Panda",
        "listener, split test, max steps 200",
        "listener, split val, max steps 1300",
    ]


@pytest.mark.parametrize("order", [["listener", "random"], ["random", "listener"]])
def test_tables_of_policies_stand_in_the_order_of_the_plan_and_the_legend_below_the_last(order):
    """`order` is the plan's; one of the two policies is privileged, which the legend explains."""
    results = [*make_results("1"), *make_results("1", policy="random", privileged=True)]
    planned = [make_result(policy=name).identity for name in order]

    tables = make_run_tables(frame_of(results, planned=planned))

    assert [table.title.split()[0] for table in tables] == order
    assert "privileged policies" in tables[-1].notes[-1]


def test_a_suite_that_was_played_in_part_is_marked_in_the_table_of_forms():
    """A suite is a group of tasks, of which the table shows the mean. Only one of the four tasks of
    counting was played, so the mean is marked by a star, which a note explains. The table needs
    both forms of instructions: the implicit one, and the one with references spelled out
    (resolved).
    """
    results = [*make_results("10", "direct"), *make_results("11", "direct", form="resolved")]

    table = diagnostic_tables()["forms"].make(RunData(frame_of(results)))

    assert [row.group for row in table.rows] == ["listener, counting *"]
    assert "* a partial average: a task is incomplete or was not played." in table.notes


def test_results_have_what_the_calls_of_models_cost_and_none_where_it_is_unknown():
    """The first episode reports all but its output tokens, the second nothing."""
    asked = make_result(usage={"calls": 3.0, "input_tokens": 1200.0, "cost_usd": 0.25})
    frame = frame_of([asked, make_result(episode=1)])

    assert frame["model_calls"].tolist() == [3, None]
    assert frame["input_tokens"].tolist() == [1200, None]
    assert frame["output_tokens"].tolist() == [None, None]
    assert frame["cost_usd"].tolist() == [0.25, None]
