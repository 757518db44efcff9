"""The terminal's table of a run, and the list of its failures."""

from __future__ import annotations

import io

import pytest
from flat_jobs import job_of
from made_records import make_record
from rich.console import Console

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.stats.option_labels import REFERENCE, options_label
from roboirg.evaluation.analysis.stats.paired_tests import Overlap
from roboirg.evaluation.analysis.stats.rates import points
from roboirg.evaluation.analysis.stats.run_summary import ALL, Scope
from roboirg.evaluation.analysis.tables.run_tables import (
    NO_GAP,
    gap_text,
    make_run_tables,
    print_failures,
    print_run_tables,
)
from roboirg.evaluation.records.record import Job, Record

DIRECT = InstructionOptions("direct")
TASK = Scope(task="PickXtimes")


def record(
    outcome: str,
    episode: int = 0,
    setting: str = "explicit",
    cause: str | None = "because",
    **fields: object,
) -> Record:
    job = job_of(
        **{
            "policy": "listener",
            "task": "PickXtimes",
            "split": "test",
            "episode": episode,
            "setting": setting,
            **fields,
        }
    )
    cause = None if outcome == "success" else cause
    return make_record(job, outcome, cause=cause)  # type: ignore[arg-type]


def printed(records: list[Record], planned: tuple[Job, ...] = ()) -> str:
    """The tables as words between single blanks."""
    console = Console(file=io.StringIO(), width=40)
    print_run_tables(make_run_tables(records, planned), console)
    return " ".join(console.file.getvalue().split())  # type: ignore[attr-defined]


def failures_text(records: list[Record]) -> str:
    console = Console(file=io.StringIO(), width=40)
    print_failures(records, make_run_tables(records), console)
    return console.file.getvalue()  # type: ignore[attr-defined,no-any-return]


def test_the_gap_is_over_the_same_episodes() -> None:
    records = [
        record("success", 0),
        record("success", 1),
        record("failure", 2),
        record("error", 3),
        record("failure", 0, "direct"),
        record("success", 1, "direct"),
        record("success", 2, "direct"),
        record("failure", 3, "direct"),  # its explicit twin has no verdict
        record("error", 4, "direct"),
        record("failure", 5, "direct"),  # it has no explicit twin
    ]
    (table,) = make_run_tables(records)
    direct = table.cells[TASK, DIRECT]
    assert (direct.successes, direct.trials, direct.errors) == (2, 5, 1)
    assert direct.explicit_overlap() == Overlap(both=1, only_first=1, only_second=1, neither=0)
    assert float(direct.pooled_rate) == 0.4
    assert not direct.is_complete
    explicit = table.cells[TASK, REFERENCE]
    assert (explicit.trials, explicit.errors) == (3, 1)
    assert float(explicit.pooled_rate) == pytest.approx(2 / 3)
    assert table.cells[ALL, DIRECT].explicit_overlap() == direct.explicit_overlap()
    assert "40 (±0) 1!" in printed(records)


def test_seeds_and_tasks_are_not_mixed_up() -> None:
    records = [
        record("success", policy_seed=0),
        record("failure", policy_seed=1),
        record("failure", task="VideoUnmask"),
        record("failure", setting="direct", policy_seed=0),
        record("failure", setting="direct", policy_seed=1),
        record("success", setting="direct", task="VideoUnmask"),
    ]
    (table,) = make_run_tables(records)
    assert table.tasks == ("PickXtimes", "VideoUnmask")
    gaps = {
        scope: gap_text(table.cells[scope, DIRECT].explicit_overlap())
        for scope in (TASK, Scope(task="VideoUnmask"), ALL)
    }
    assert list(gaps.values()) == ["−50", "+100", "±0"]


def test_all_tasks_are_pooled_over_trials() -> None:
    records = [record("success", episode) for episode in range(3)]
    records.append(record("failure", task="VideoUnmask"))
    (table,) = make_run_tables(records)
    everything = table.cells[ALL, REFERENCE]
    assert (float(everything.pooled_rate), float(everything.rate)) == (0.75, 0.5)
    assert "all tasks │ 75" in printed(records)
    assert "n = 1–3 episodes per cell, 4 for all tasks" in printed(records)


def test_missing_episodes_are_counted() -> None:
    planned = tuple(record("success", episode, "direct").identity for episode in range(4))
    (table,) = make_run_tables([record("success", 0, "direct")], planned)
    cell = table.cells[TASK, DIRECT]
    assert (cell.missing, cell.trials) == (3, 1)
    (unplayed,) = make_run_tables([], planned)
    assert unplayed.cells[TASK, DIRECT].pooled_rate is None


def test_other_options_have_columns_of_their_own() -> None:
    records = [
        record("success", setting="contextual"),
        record("success", setting="contextual", form="resolved"),
        record("success", setting="contextual", stages=(1, 5)),
        record("success", setting="spatial", frame="camera"),
        record("success"),
    ]
    (table,) = make_run_tables(records)
    assert [options_label(options) for options in table.columns] == [
        "explicit",
        "contextual",
        "contextual (stages 1,5)",
        "contextual (resolved)",
        "spatial (camera frame)",
    ]


def test_policies_and_conditions_have_tables_of_their_own() -> None:
    records = [record("success", split=split) for split in ("test", "val")]
    records += [record("success", policy="random"), record("success", max_steps=200)]
    assert [table.label for table in make_run_tables(records)] == [
        "listener, split test, max steps 1300 (privileged)",
        "listener, split test, max steps 200 (privileged)",
        "listener, split val, max steps 1300 (privileged)",
        "random, split test, max steps 1300",
    ]


def test_policies_have_the_order_of_the_plan() -> None:
    records = [record("success", policy=name) for name in ("random", "listener")]
    planned = [one.identity for one in reversed(records)]
    assert [table.label for table in make_run_tables(records, planned)] == [
        "listener (privileged)",
        "random",
    ]


def test_each_failure_is_listed_with_its_cause() -> None:
    long = "picked up the green cube [1]; expected: pick up the red cube for the first time"
    direct = {"setting": "direct", "policy": "oracle"}
    assert failures_text(
        [
            record("success", 3, **direct),
            record("error", 7, cause="environment: worker died (signal 9)", **direct),
            record("failure", 3, cause=long, form="resolved", policy_seed=2, **direct),
            record("failure", 3, cause="pressed the button", **direct | {"policy": "random"}),
        ]
    ).splitlines() == [
        "oracle (privileged): 2 episodes without success",
        f"  PickXtimes test/3 direct (resolved) (policy seed 2): {long}",
        "  PickXtimes test/7 direct: environment: worker died (signal 9) !",
        "random: 1 episode without success",
        "  PickXtimes test/3 direct: pressed the button",
    ]


def test_many_failures_are_counted_and_none_is_not_listed() -> None:
    many = [record("failure", episode, cause="late") for episode in reversed(range(13))]
    lines = failures_text(many).splitlines()
    assert [line.split()[1] for line in lines[1:11]] == [f"test/{index}" for index in range(10)]
    assert lines[11:] == ["  and 3 more"]
    assert failures_text([record("success")]) == ""


def test_the_table_shows_rates_gaps_and_what_is_incomplete() -> None:
    records = [record("success", episode, policy="p") for episode in range(4)]
    records += [
        record("success", 0, "direct", policy="p"),
        record("failure", 1, "direct", policy="p"),
        record("failure", 2, "direct", policy="p"),
        record("error", 3, "direct", policy="p"),
    ]
    planned = tuple(record("success", one, "direct", policy="p").identity for one in range(6))
    text = printed(records, planned)
    assert "100" in text
    assert "33 (−67) 1! 2…" in text
    assert "ended in an error" in text
    assert "still to be played" in text
    assert "all tasks" not in text  # there is only one
    assert "in brackets the gap" in text
    assert "privileged" not in text
    assert "n = 3–4 episodes per cell" in text
    assert "(–)" not in text


def test_the_legend_explains_only_what_occurs() -> None:
    text = printed([record("success")])
    assert "in brackets" not in text
    assert "privileged policies and scripted hands use the simulator's state" in text
    assert "n = 1 episode per cell" in text


def test_points_have_a_sign() -> None:
    assert [points(gap) for gap in (-0.5, 0.25, 0.0, -0.001)] == ["−50", "+25", "±0", "±0"]
    assert [points(gap, 1) for gap in (-0.5, 0.0004, 0.0006)] == ["−50.0", "±0.0", "+0.1"]


def test_without_any_success_there_is_no_gap() -> None:
    assert gap_text(Overlap(both=0, only_first=0, only_second=0, neither=4)) == NO_GAP
    assert gap_text(Overlap(both=0, only_first=1, only_second=0, neither=3)) == "+25"
    assert gap_text(Overlap(both=2, only_first=0, only_second=0, neither=2)) == "±0"
    assert gap_text(Overlap(0, 0, 0, 0)) == ""
    records = [
        record("failure", setting=setting, task=task)
        for setting in ("explicit", "direct")
        for task in ("PickXtimes", "VideoUnmask")
    ]
    text = printed(records)
    assert "0 (–)" in text
    assert "explicit has no success either" in text
    assert "n = 1 episode per cell, 2 for all tasks" in text


def test_wide_tables_are_drawn_in_parts_and_names_are_whole() -> None:
    task = "VideoUnmaskSwap"
    records = [
        record("success", setting=setting, form=form, task=name)
        for setting in ("explicit", "direct", "reasoning", "contextual", "spatial")
        for form in ("implicit", "resolved")
        for name in (task, "PickXtimes")
    ]
    for width in (10, 80, 400):
        console = Console(file=io.StringIO(), width=width)
        print_run_tables(make_run_tables(records), console)
        text = console.file.getvalue()
        assert text.count(task) == (1 if width == 400 else 2)
        assert "spatial (resolved)" in text
        assert "…" not in text
        assert text.count("listener (privileged)") == 1
