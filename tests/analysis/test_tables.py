from __future__ import annotations

import io

from rich.console import Console

from roboirg.analysis.stats.success_rates import EXPLICIT, Cell, Condition, Panel, SettingColumn
from roboirg.analysis.tables.run_tables import (
    NO_GAP,
    gap_text,
    points,
    print_failures,
    print_tables,
)
from roboirg.evaluation.rollout_result import RolloutResult, make_record
from roboirg.records.record import Job, Record


def record(
    outcome: str, cause: str | None = None, episode: int = 3, policy: str = "oracle", **told
):
    told = {"setting": "direct", **told}
    job = Job(policy=policy, task="PickXtimes", split="test", episode=episode, **told)
    return make_record(job, RolloutResult(outcome, cause=cause), started_at="now")


def failures_text(records: list[Record], most: int = 10) -> str:
    console = Console(file=io.StringIO(), width=40)
    print_failures(records, console, most)
    return console.file.getvalue()  # type: ignore[attr-defined,no-any-return]


def test_each_failure_is_named_with_its_cause() -> None:
    long = "picked up the green cube [1]; expected: pick up the red cube for the first time"
    assert failures_text(
        [
            record("success"),
            record("error", "environment: worker died (signal 9)", episode=7),
            record("failure", long, form="resolved", policy_seed=2),
            record("failure", "pressed the button", policy="random"),
        ]
    ).splitlines() == [
        "oracle: 2 episodes without success",
        f"  PickXtimes test/3 direct (resolved) (policy seed 2): {long}",
        "  PickXtimes test/7 direct: environment: worker died (signal 9) !",
        "random: 1 episode without success",
        "  PickXtimes test/3 direct: pressed the button",
    ]


def test_many_failures_are_counted_and_none_is_not_told() -> None:
    many = [record("failure", "late", episode=number) for number in reversed(range(5))]
    lines = failures_text(many, most=2).splitlines()
    assert [line.split()[1] for line in lines[1:3]] == ["test/0", "test/1"]
    assert lines[3:] == ["  and 3 more"]
    assert failures_text([record("success")]) == ""


def test_the_table_says_rates_gaps_and_what_is_amiss() -> None:
    direct, spatial = SettingColumn("direct"), SettingColumn("spatial")
    panel = Panel(
        "listener",
        Condition("listener", "test", 1300),
        ("PickXtimes",),
        (EXPLICIT, direct, spatial),
        {
            ("PickXtimes", EXPLICIT): Cell(4, 0, pairs=4, gap=0.0),
            ("PickXtimes", direct): Cell(1, 2, errors=1, missing=2, pairs=3, gap=-2 / 3),
            (None, EXPLICIT): Cell(4, 0),
            (None, direct): Cell(1, 2, errors=1, missing=2, pairs=3, gap=-2 / 3),
        },
    )
    console = Console(file=io.StringIO(), width=40)
    print_tables([panel], console)
    text = " ".join(console.file.getvalue().split())  # type: ignore[attr-defined]
    assert "100" in text
    assert "33 (−67) 1! 2…" in text
    assert "ended in an error" in text
    assert "still to be played" in text
    assert "all tasks" not in text  # there is only one
    assert "in brackets the gap" in text
    assert "privileged" not in text
    assert "n = 3–4 episodes per cell" in text
    assert "(–)" not in text


def test_the_legend_says_nothing_about_what_is_not_there() -> None:
    panel = Panel(
        "oracle (privileged)",
        Condition("oracle", "test", 1300),
        ("PickXtimes",),
        (EXPLICIT,),
        {("PickXtimes", EXPLICIT): Cell(4, 0, pairs=4, gap=0.0)},
        privileged=True,
    )
    console = Console(file=io.StringIO(), width=100)
    print_tables([panel], console)
    text = " ".join(console.file.getvalue().split())  # type: ignore[attr-defined]
    assert "in brackets" not in text
    assert "privileged policies look behind the scenes" in text


def test_points_have_a_sign() -> None:
    assert [points(gap) for gap in (-0.5, 0.25, 0.0, -0.001)] == ["−50", "+25", "±0", "±0"]


def test_the_floor_has_no_gap() -> None:
    assert gap_text(Cell(0, 4, pairs=4, gap=0.0, explicit=0.0)) == NO_GAP
    assert gap_text(Cell(1, 3, pairs=4, gap=0.25, explicit=0.0)) == "+25"
    assert gap_text(Cell(2, 2, pairs=4, gap=0.0, explicit=0.5)) == "±0"
    assert gap_text(Cell(2, 2)) == ""
    panel = Panel(
        "random",
        Condition("random", "test", 1300),
        ("PickXtimes", "VideoUnmask"),
        (EXPLICIT, SettingColumn("direct")),
        {
            ("PickXtimes", EXPLICIT): Cell(0, 4, pairs=4, gap=0.0, explicit=0.0),
            ("PickXtimes", SettingColumn("direct")): Cell(0, 4, pairs=4, gap=0.0, explicit=0.0),
            (None, EXPLICIT): Cell(0, 4, pairs=4, gap=0.0, explicit=0.0),
        },
    )
    console = Console(file=io.StringIO(), width=100)
    print_tables([panel], console)
    text = " ".join(console.file.getvalue().split())  # type: ignore[attr-defined]
    assert "0 (–)" in text
    assert "which says nothing" in text
    assert "n = 4 episodes per cell, 4 for all tasks" in text
