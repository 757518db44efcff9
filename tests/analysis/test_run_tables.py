"""The terminal's table of a run, and the list of its failures."""

from __future__ import annotations

import io
from collections.abc import Sequence

from flat_jobs import job_of
from made_records import make_record
from rich.console import Console

from roboirg.evaluation.analysis.frame import make_frame
from roboirg.evaluation.analysis.stats.rates import points
from roboirg.evaluation.analysis.tables.run_tables import (
    make_run_tables,
    print_failures,
    print_run_tables,
)
from roboirg.evaluation.analysis.tables.table import Table
from roboirg.evaluation.records.record import Job, Record


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


def tables_of(records: list[Record], planned: Sequence[Job] = ()) -> list[Table]:
    return make_run_tables(make_frame([("", records)], planned))


def printed(records: list[Record], planned: tuple[Job, ...] = (), width: int = 120) -> str:
    console = Console(file=io.StringIO(), width=width)
    print_run_tables(tables_of(records, planned), console)
    lines = console.file.getvalue().splitlines()  # type: ignore[attr-defined]
    return "".join(f"{line.rstrip()}\n" for line in lines)


def texts(records: list[Record]) -> dict[str, list[str]]:
    """The cells of the only table as they are printed, by task."""
    (table,) = tables_of(records)
    return {row.name: list(map(str, row.entries)) for row in table.rows}


def failures_text(records: list[Record]) -> str:
    console = Console(file=io.StringIO(), width=40)
    print_failures(make_frame([("", records)]), console)
    return console.file.getvalue()  # type: ignore[attr-defined,no-any-return]


TABLES = """\
listener (privileged)
┏━━━━━━━━━━━━━┳━━━━━━━━━━┳━━━━━━━━━━━━━━━┓
┃ task        ┃ explicit ┃        direct ┃
┡━━━━━━━━━━━━━╇━━━━━━━━━━╇━━━━━━━━━━━━━━━┩
│ PickXtimes  │   67 1!≠ │ 40 (±0) 1! 1… │
│ VideoUnmask │      0 ≠ │         0 (–) │
├─────────────┼──────────┼───────────────┤
│ all tasks   │    50 1! │ 33 (±0) 1! 1… │
└─────────────┴──────────┴───────────────┘
Played on the test split, in our own words, with at most 1300 steps. n = 1–5 episodes per cell, 4–6 for all tasks
≠ not comparable with the published rate: our own words; 3 of 50 episodes (PickXtimes); 1 error (PickXtimes); 1 of 50
episodes (VideoUnmask).
random
┏━━━━━━━━━━━━┳━━━━━━━━┓
┃ task       ┃ direct ┃
┡━━━━━━━━━━━━╇━━━━━━━━┩
│ PickXtimes │    100 │
└────────────┴────────┘
Played on the test split, in our own words, with at most 1300 steps. n = 1 episode per cell
success rate in %, in brackets the gap to explicit on the same episodes in points; (–) explicit has no success either,
so the gap says nothing; ! episodes ended in an error and are left out of the rates; … episodes are still to be played;
privileged policies and scripted hands use the simulator's state
"""  # noqa: E501


def test_the_table_shows_rates_gaps_and_what_is_incomplete() -> None:
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
        record("failure", task="VideoUnmask"),
        record("failure", setting="direct", task="VideoUnmask"),
        record("success", policy="random", setting="direct"),
    ]
    missing = record("success", 6, "direct").identity
    assert printed(records, (*(one.identity for one in records), missing)) == TABLES
    assert printed([record("success", policy="random")]).endswith("\nsuccess rate in %\n")


def test_seeds_and_tasks_are_not_mixed_up() -> None:
    records = [
        record("success", policy_seed=0),
        record("failure", policy_seed=1),
        record("failure", task="VideoUnmask"),
        record("failure", setting="direct", policy_seed=0),
        record("failure", setting="direct", policy_seed=1),
        record("success", setting="direct", task="VideoUnmask"),
    ]
    assert texts(records) == {
        "PickXtimes": ["50 ≠", "0 (−50)"],
        "VideoUnmask": ["0 ≠", "100 (+100)"],
        "all tasks": ["33", "33 (±0)"],
    }


def test_other_options_have_columns_of_their_own() -> None:
    records = [
        record("success", setting="contextual"),
        record("success", setting="contextual", form="resolved"),
        record("success", setting="contextual", stages=(1, 5)),
        record("success", setting="spatial", frame="camera"),
        record("success"),
    ]
    (table,) = tables_of(records)
    assert [column.name for column in table.columns] == [
        "explicit",
        "contextual",
        "contextual (stages 1,5)",
        "contextual (resolved)",
        "spatial (camera frame)",
    ]


def test_policies_and_conditions_have_tables_of_their_own_in_the_order_of_the_plan() -> None:
    records = [record("success", split=split) for split in ("test", "val")]
    records += [record("success", policy="random"), record("success", max_steps=200)]
    labels = [
        "listener, split test, max steps 1300 (privileged)",
        "listener, split test, max steps 200 (privileged)",
        "listener, split val, max steps 1300 (privileged)",
        "random, split test, max steps 1300",
    ]
    assert [table.title for table in tables_of(records)] == labels
    planned = [record("success", policy=name).identity for name in ("random", "listener")]
    tables = tables_of(records, planned)
    assert [table.title for table in tables] == [labels[3], *labels[:3]]


def test_a_plan_without_results_has_a_table() -> None:
    planned = tuple(record("success", episode, "direct").identity for episode in range(4))
    assert "│ PickXtimes │   – 4… │" in printed([], planned)


def test_wide_tables_are_drawn_in_parts_and_names_are_whole() -> None:
    task = "VideoUnmaskSwap"
    records = [
        record("success", setting=setting, form=form, task=name)
        for setting in ("explicit", "direct", "reasoning", "contextual", "spatial")
        for form in ("implicit", "resolved")
        for name in (task, "PickXtimes")
    ]
    for width in (10, 80, 400):
        text = printed(records, width=width)
        assert text.count(task) == (1 if width == 400 else 2)
        assert "spatial (resolved)" in text
        assert "…" not in text


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


def test_points_have_a_sign() -> None:
    assert [points(gap) for gap in (-0.5, 0.25, 0.0, -0.001)] == ["−50", "+25", "±0", "±0"]
    assert [points(gap, 1) for gap in (-0.5, 0.0004, 0.0006)] == ["−50.0", "±0.0", "+0.1"]
