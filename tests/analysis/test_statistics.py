from __future__ import annotations

from dataclasses import replace

import pytest

from roboirg.analysis.stats.success_rates import (
    EXPLICIT,
    Cell,
    InstructionOptions,
    make_panels,
    wilson_interval,
)
from roboirg.evaluation.rollout_result import RolloutResult, make_record
from roboirg.records.record import Job, Record

DIRECT = InstructionOptions("direct")


def record(outcome: str, episode: int = 0, setting: str = "explicit", **fields: object) -> Record:
    job = Job(
        **{
            "policy": "listener",
            "task": "PickXtimes",
            "split": "test",
            "episode": episode,
            "setting": setting,
            **fields,
        }
    )
    cause = None if outcome == "success" else "because"
    return make_record(job, RolloutResult(outcome, cause=cause), started_at="now")  # type: ignore[arg-type]


# By hand, z = 1.96: 8 of 10 is 0.8 with weight 0.38415, center 0.99207 / 1.38415 = 0.71674,
# half 1.96 * sqrt(0.016 + 0.0096036) / 1.38415 = 0.22658. Also in Newcombe 1998, table I.
@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        (8, 10, 0.4902, 0.9433),
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (20, 20, 0.8389, 1.0),
    ],
)
def test_wilson(successes: int, trials: int, low: float, high: float) -> None:
    assert wilson_interval(successes, trials) == pytest.approx((low, high), abs=5e-5)


@pytest.mark.parametrize(("successes", "trials"), [(0, 0), (3, 2), (-1, 2)])
def test_no_interval_of_nonsense(successes: int, trials: int) -> None:
    with pytest.raises(ValueError, match="not a proportion"):
        wilson_interval(successes, trials)


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
    (panel,) = make_panels(records)
    cell = panel.cells["PickXtimes", DIRECT]
    assert cell == Cell(
        successes=2, failures=3, errors=1, pairs=3, gap=0.0, explicit=pytest.approx(2 / 3)
    )
    assert not cell.is_at_floor
    assert cell.rate == 0.4
    assert not cell.is_complete
    explicit = panel.cells["PickXtimes", EXPLICIT]
    assert (explicit.trials, explicit.errors, explicit.rate) == (3, 1, pytest.approx(2 / 3))
    assert panel.cells[None, DIRECT] == cell


def test_seeds_and_tasks_are_not_mixed_up() -> None:
    records = [
        record("success", policy_seed=0),
        record("failure", policy_seed=1),
        record("failure", task="VideoUnmask"),
        record("failure", setting="direct", policy_seed=0),
        record("failure", setting="direct", policy_seed=1),
        record("success", setting="direct", task="VideoUnmask"),
    ]
    (panel,) = make_panels(records)
    assert panel.tasks == ("PickXtimes", "VideoUnmask")
    assert panel.cells["PickXtimes", DIRECT].gap == -0.5
    assert panel.cells["VideoUnmask", DIRECT].gap == 1.0
    assert panel.cells[None, DIRECT].gap == 0.0


def test_what_is_planned_and_lacking_is_counted() -> None:
    planned = [record("success", episode, "direct").identity for episode in range(4)]
    (panel,) = make_panels([record("success", 0, "direct")], planned)
    cell = panel.cells["PickXtimes", DIRECT]
    assert (cell.missing, cell.trials) == (3, 1)
    assert not panel.is_complete


def test_unusual_tellings_have_columns_of_their_own() -> None:
    records = [
        record("success", setting="contextual"),
        record("success", setting="contextual", form="resolved"),
        record("success", setting="contextual", stages=(1, 5)),
        record("success", setting="spatial", frame="camera"),
        record("success"),
    ]
    (panel,) = make_panels(records)
    assert [options_label(options) for options in panel.columns] == [
        "explicit",
        "contextual",
        "contextual (stages 1,5)",
        "contextual (resolved)",
        "spatial (camera frame)",
    ]


def test_policies_and_rules_have_panels_of_their_own() -> None:
    records = [record("success", split=split) for split in ("test", "val")]
    records += [record("success", policy="random"), record("success", max_steps=200)]
    assert [panel.label for panel in make_panels(records)] == [
        "listener (privileged) · test · at most 1300 steps",
        "listener (privileged) · val · at most 1300 steps",
        "random · test · at most 1300 steps",
        "listener (privileged) · test · at most 200 steps",
    ]


def test_a_cell_without_a_verdict_has_no_rate() -> None:
    empty = replace(Cell(), errors=1)
    assert (empty.rate, empty.interval) == (None, None)


def test_where_nothing_succeeds_in_explicit_the_gap_is_at_the_floor() -> None:
    records = [record("failure"), record("failure", setting="direct")]
    (panel,) = make_panels(records)
    cell = panel.cells["PickXtimes", DIRECT]
    assert (cell.gap, cell.explicit, cell.is_at_floor) == (0.0, 0.0, True)
    (panel,) = make_panels(records[1:])
    assert not panel.cells["PickXtimes", DIRECT].is_at_floor  # nobody knows


def test_cells_stand_in_the_order_of_the_table() -> None:
    records = [
        record("success", setting="direct", form="resolved"),
        record("success", task="VideoUnmask", setting="direct"),
        record("success", task="VideoUnmask"),
        record("success", setting="direct"),
    ]
    planned = [record("success", task="VideoUnmask").identity]
    (panel,) = make_panels(records, planned)
    assert [(task, options_label(options)) for task, options in panel.cells] == [
        ("VideoUnmask", "explicit"),
        ("VideoUnmask", "direct"),
        ("PickXtimes", "direct"),
        ("PickXtimes", "direct (resolved)"),
        (None, "explicit"),
        (None, "direct"),
        (None, "direct (resolved)"),
    ]
    assert panel.trials([None]) == (1, 2)
    assert panel.trials(panel.tasks) == (1, 1)
