"""Runs that stop when what they compare is decided."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from made_records import fill, make_record
from run_fakes import SCENES, Lucky, changed, found_in, line_count, small_plan, two_policies

from roboirg.core.errors import InvalidValueError
from roboirg.records.store import read_results
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.plan.plan_sections import StopRule
from roboirg.runs.plan.stopping import PlanScene, scene_of, scene_order
from roboirg.runs.plan.stored_plans import read_plan
from roboirg.runs.run.executor import InProcess, LocalProcesses
from roboirg.runs.run.runner import run_plan


def lucky_run(folder, plan):
    """Run a plan in this process; ``random`` wins 95 % of scenes, every other policy 30 %."""
    return run_plan(plan, folder, Lucky(), InProcess())


def scenes_in_order(plan):
    """Return the scenes of a plan in the order in which they are played."""
    return scene_order({scene_of(job) for job in plan.jobs()}, "test")


def test_the_order_of_scenes_is_random_and_the_same_for_every_plan():
    """Of a smaller plan the scenes come in the order that they have in a larger one."""
    few = [PlanScene("PickXtimes", episode) for episode in range(10)]
    many = [PlanScene("PickXtimes", episode) for episode in range(50)]

    order = scene_order(many, "test")

    assert order != many
    assert scene_order(few, "test") == [scene for scene in order if scene in few]
    assert scene_order(many, "val") != order


def test_a_run_of_two_policies_stops_when_one_is_clearly_better(tmp_path):
    """One policy wins 95 % of scenes, the other 30 %: 50 scenes are more than it takes."""
    plan = two_policies()

    summary = lucky_run(tmp_path, plan)

    (decision,) = found_in(tmp_path, plan)
    assert decision.finding == "first"
    assert summary.played == 2 * decision.scenes
    assert summary.spared == 2 * (SCENES - decision.scenes)
    assert summary.missing == 0


def test_both_policies_play_a_scene_before_any_plays_the_next(tmp_path):
    """Else no look would be possible before one policy has played all of its episodes."""
    plan = two_policies(episodes=6)

    lucky_run(tmp_path, plan)

    scenes = [scene_of(result) for result in read_results(tmp_path)]
    assert scenes[0::2] == scenes[1::2]
    assert scenes[0::2] == scene_order(set(scenes), "test")[: len(scenes) // 2]


@pytest.mark.parametrize("workers", [1, 4])
def test_any_number_of_workers_decides_at_the_same_scene(tmp_path, workers):
    """Workers play scenes ahead; what they finish after the decision does not count."""
    plan = two_policies()
    lucky_run(tmp_path / "alone", plan)

    run_plan(plan, tmp_path / "workers", Lucky(seconds=0.01), LocalProcesses(workers))

    assert found_in(tmp_path / "workers", plan) == found_in(tmp_path / "alone", plan)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 4])
def test_a_run_that_is_killed_ten_times_decides_at_the_same_scene(tmp_path, workers):
    """Each time the process gets SIGKILL when some more records are stored; the last one ends."""
    plan = two_policies()
    lucky_run(tmp_path / "whole", plan)
    killed = tmp_path / "killed"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}  # with the helpers
    for kill in range(10):
        command = [sys.executable, __file__, str(killed), str(workers)]
        child = subprocess.Popen(command, env=environment)
        while line_count(killed) <= 2 * kill and child.poll() is None:
            time.sleep(0.02)
        child.send_signal(signal.SIGKILL)
        child.wait()
    assert line_count(killed) >= 10

    run_plan(plan, killed, Lucky(), LocalProcesses(workers))

    assert found_in(killed, plan) == found_in(tmp_path / "whole", plan)


def test_without_the_rule_the_run_goes_on_to_the_end_and_plays_nothing_twice(tmp_path):
    """A run that stopped is continued as a full one: only what was spared is played."""
    stopped = lucky_run(tmp_path, two_policies())

    full = lucky_run(tmp_path, two_policies(stop=None))

    assert stopped.spared > 0
    assert full.played == stopped.spared
    assert (full.missing, full.spared) == (0, 0)


def lucky_but(policy, scenes, *ending, **fields):
    """Return a way to play in which a policy ends some scenes in another way."""

    def play(job):
        if job.policy == policy and scene_of(job) in scenes:
            return make_record(job, *ending, **fields)
        return Lucky()(job)

    return play


def test_an_error_that_stays_leaves_its_scene_out(tmp_path):
    """The first scene ends in an error of a policy, which is not tried again."""
    plan = two_policies()
    first_scene = scenes_in_order(plan)[0]
    play = lucky_but("oracle", [first_scene], "error", "broken", error="policy")

    run_plan(plan, tmp_path, play, InProcess())

    (decision,) = found_in(tmp_path, plan)
    assert decision.finding == "first"
    assert decision.scenes == decision.places - 1


def test_an_error_with_tries_left_is_played_again_even_if_others_are_not(tmp_path):
    """Else all looks would wait for its scene, and the whole plan would be played for nothing."""
    plan = two_policies()
    first_scene = scenes_in_order(plan)[0]
    (job,) = (job for job in plan.jobs() if scene_of(job) == first_scene and job.policy == "oracle")
    fill(tmp_path, make_record(job, "error", "lost", error="connection", attempt=1))

    summary = run_plan(plan, tmp_path, Lucky(), InProcess(), retry_errors=False)

    (decision,) = found_in(tmp_path, plan)
    assert decision.finding == "first"
    assert decision.scenes == decision.places
    assert summary.spared > 0


def test_a_decision_that_an_error_played_again_opens_is_played_on(tmp_path):
    """The policy that is better loses the scenes that had ended in its errors, when resumed."""
    plan = two_policies()
    scenes = scenes_in_order(plan)[:4]
    broken = lucky_but("random", scenes, "error", "broken", error="policy")
    mended = lucky_but("random", scenes, "failure", "picked the wrong cube")

    run_plan(plan, tmp_path / "once", mended, InProcess())
    earlier = run_plan(plan, tmp_path / "resumed", broken, InProcess())
    resumed = run_plan(plan, tmp_path / "resumed", mended, InProcess())

    assert resumed.spared < earlier.spared
    assert resumed.missing == 0
    assert found_in(tmp_path / "resumed", plan) == found_in(tmp_path / "once", plan)


def test_a_plan_that_cannot_stop_is_not_written(tmp_path):
    """Else the tables of what the folder holds already could not be made any more."""
    full = small_plan(4, policies=("random", "oracle", "listener"))
    lucky_run(tmp_path, full)

    with pytest.raises(InvalidValueError, match="this plan has 3: random, oracle, listener"):
        lucky_run(tmp_path, changed(full, stop=StopRule()))

    assert read_plan(tmp_path) == full


def test_a_plan_of_one_policy_in_one_setting_has_nothing_to_compare(tmp_path):
    plan = changed(small_plan(4), settings="direct", stop=StopRule())

    with pytest.raises(InvalidValueError, match="stop has nothing to compare"):
        lucky_run(tmp_path, plan)


def test_control_arms_and_a_stop_exclude_each_other():
    """An arm has other words than its scene's own, so it is no side of a comparison."""
    with pytest.raises(InvalidValueError, match="compares episodes in their own words"):
        make_plan("random,oracle", tasks="PickXtimes", arms="told,silent", stop={})


def test_a_plan_without_the_rule_has_the_fingerprint_that_it_always_had():
    """The fingerprint stands in records; a new option must not make old plans differ."""
    plan = small_plan(4)

    assert '"stop":null' in plan.model_dump_json()
    assert plan.fingerprint == "4dd2e40e9a11"


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    workers = int(sys.argv[2])
    run_plan(two_policies(), folder, Lucky(seconds=0.02), LocalProcesses(workers))
