from __future__ import annotations

from pathlib import Path

import pytest
from evaluation_fakes import FakePlay, small_plan
from msgspec.structs import replace

from roboirg.evaluation.episode_errors import EpisodeError
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.records.store import RecordStore, read_index
from roboirg.evaluation.run import world_speed
from roboirg.evaluation.run.estimate import ORACLE_STEPS, cell_sizes, estimate, estimate_text
from roboirg.evaluation.run.world_speed import ASSUMED, WorldSpeed, has_video, measure_world


def test_cells_are_counted_by_policy_task_setting_and_form() -> None:
    plan = make_plan(
        ["random"], tasks="PickXtimes,StopCube", forms="implicit,resolved", episodes="3"
    )
    sizes = cell_sizes(plan.jobs())
    assert sizes["random", "StopCube"]["direct"] == {"implicit": 3, "resolved": 3}
    assert sizes["random", "StopCube"]["explicit"] == {"implicit": 3}
    assert "spatial" not in sizes["random", "StopCube"]
    total = sum(count for cell in sizes.values() for forms in cell.values() for count in
                forms.values())  # fmt: skip
    assert total == len(plan.jobs())


SPEED = WorldSpeed(0.01, {False: 0.5, True: 4.5})


def test_what_was_measured_replaces_what_is_assumed(tmp_path: Path) -> None:
    jobs = small_plan(4).jobs()
    with RecordStore(tmp_path) as store:
        for job in jobs[:2]:
            store.append(replace(FakePlay()(job), duration_s=30.0))
    guess = estimate(jobs, (), 2, SPEED)
    known = estimate(jobs, read_index(tmp_path).values(), 2, SPEED)
    assert (guess.episodes, guess.max_steps, guess.unknown) == (8, 8 * 1300, 8)
    resets = sum(SPEED.reset_s[has_video(job)] for job in jobs)
    assert guess.least == pytest.approx((resets + 8 * ORACLE_STEPS * 0.01) / 2)
    assert guess.most == pytest.approx((resets + 8 * 1300 * 0.01) / 2)
    assert (known.least, known.most, known.unknown) == (8 * 30.0 / 2, 8 * 30.0 / 2, 0)
    assert (
        "about 2 min on 2 workers, as long as the stored ones"
        in estimate_text(known, 10, 2, SPEED)[1]
    )
    assert estimate_text(known, 10, 2, SPEED)[0] == "10 episodes, 2 already stored."


def test_the_limit_of_the_policy_bounds_both_ends() -> None:
    jobs = [replace(job, max_steps=100) for job in small_plan(4).jobs()]
    found = estimate(jobs, (), 1, SPEED)
    assert found.least == found.most
    assert "10.0 ms (measured just now)" in estimate_text(found, 8, 1, SPEED)[2]
    assert "assumed" in estimate_text(estimate(jobs, (), 1, ASSUMED), 8, 1, ASSUMED)[2]


def test_nothing_left_is_said_so() -> None:
    nothing = estimate((), (), 1, SPEED)
    assert estimate_text(nothing, 5, 1, SPEED) == ("5 episodes, 5 already stored.",)


@pytest.mark.sim
def test_the_world_is_measured_where_it_can_be_played() -> None:
    plan = make_plan(["random"], tasks="PickXtimes,VideoRepick", settings="explicit", episodes="1")
    speed = measure_world(plan.jobs())
    assert speed.is_measured
    assert speed.step_s > 0
    assert set(speed.reset_s) == {False, True}


def test_without_a_world_the_speed_is_assumed(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise EpisodeError("environment", "no device", "")

    monkeypatch.setattr(world_speed, "play_with", refuse)
    assert measure_world(small_plan(1).jobs()) == measure_world(()) == ASSUMED
