from __future__ import annotations

from pathlib import Path

import pytest
from evaluation_fakes import FakePlay, small_plan
from msgspec.structs import replace

from roboirg.evaluation.episode_errors import EpisodeError
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.records.store import RecordStore, read_index
from roboirg.evaluation.run import world_speed
from roboirg.evaluation.run.cost_estimate import model_costs, unknown_costs
from roboirg.evaluation.run.estimate import ORACLE_STEPS, cell_sizes, estimate, estimate_text
from roboirg.evaluation.run.world_speed import ASSUMED, WorldSpeed, has_video, measure_world
from roboirg.policies.vlm.models import ModelReply
from roboirg.policies.vlm.models.reply_store import ReplySettings, ReplyStore
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode


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


def test_what_models_will_be_asked_is_counted_and_measured(tmp_path: Path) -> None:
    model = "model=x&base_url=http://localhost:1/v1"
    names = {
        "plans": f"planner:stateless?{model}&input_price=2&output_price=10",
        "often": f"planner:qwen?{model}",
        "listens": f"vlm-listener:openai?{model}&pictures=no",
        "blind": "random",
    }
    specs = [f"{name}={spec}" for name, spec in names.items()]
    tasks = "PickXtimes,VideoUnmask"
    jobs = make_plan(specs, tasks=tasks, settings="explicit", episodes="3").jobs()
    found = {one.policy: one for one in model_costs(jobs, jobs, tmp_path)}
    assert list(found) == ["plans", "often", "listens"]
    episodes = [get_episode(task, "test", index) for task in tasks.split(",") for index in range(3)]
    stages = [len(get_task(one.task).stages(one.scene, one.goal)) for one in episodes]
    assert found["plans"].sizes.calls == sum(stages) + len(stages)  # and one that says done
    assert found["often"].sizes.calls > found["plans"].sizes.calls
    assert found["listens"].sizes.calls == len(stages)
    tokens = found["plans"].sizes
    cost = (2 * tokens.input_tokens + 10 * tokens.output_tokens) / 1e6
    assert found["plans"].cost_usd == pytest.approx(cost, rel=1e-3)
    assert found["often"].cost_usd is None
    assert tokens.input_tokens > 258 * tokens.calls  # a picture each

    store = ReplyStore(ReplySettings(tmp_path), jobs[0].slug)
    for call in range(2):
        store.keep(str(call), ModelReply("done", 1000, 50), 0.0)
        store.calls += 1
    store.close()
    known = {one.policy: one for one in model_costs(jobs, jobs, tmp_path)}
    assert known["plans"].sizes == (tokens.calls, 1000 * tokens.calls, 50 * tokens.calls)
    assert [one.measured for one in known.values()] == [2, 0, 0]
    assert known["often"] == found["often"]


def test_a_planner_over_other_hands_is_counted_without_loading_them(tmp_path: Path) -> None:
    spec = "planner:qwen?model=x&base_url=http://localhost:1/v1"
    plan = make_plan([f"ours={spec}"], tasks="PickXtimes", settings="explicit", episodes="2")
    (ours,) = model_costs(plan.jobs(), plan.jobs(), tmp_path)
    assert not list(unknown_costs(plan.jobs()))
    jobs = [
        replace(job, policy=hands, spec=f"{spec}&hands={hands}")
        for hands in ("not_there:Hands", "mme-vla://localhost:1")
        for job in plan.jobs()
    ]
    assert [one.sizes for one in model_costs(jobs, jobs, tmp_path)] == [ours.sizes] * 2
    hands = [sentence.split(": how long its hands")[0] for sentence in unknown_costs(jobs)]
    assert hands == ["not_there:Hands", "mme-vla://localhost:1"]


def test_calls_of_an_own_planner_are_not_known_and_a_sentence_says_why(tmp_path: Path) -> None:
    plan = make_plan(["random"], tasks="PickXtimes", settings="explicit", episodes="2")
    specs = ("planner:not_there:Planner", "privileged:planner:not_there:Other", "not_there:Policy")
    own = [replace(one, policy=spec, spec=spec) for spec in specs for one in plan.jobs()]
    assert not model_costs(own, own, tmp_path)
    assert [sentence.split(": the number")[0] for sentence in unknown_costs(own)] == list(specs[:2])
