"""A policy's seed does not identify the episode, and no command of a scene is heard early."""

import pytest

from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.plan.stored_plans import read_plan, with_secret, write_plan
from roboirg.evaluation.play.job_instruction import PreparedJob
from roboirg.evaluation.play.rollout import load_policy
from roboirg.evaluation.run.runner import episode_runner
from roboirg.policies.contract.random_state import episode_policy_seed
from roboirg.tasks.splits.splits import SIZES, get_episode


def a_plan(**options):
    chosen = {"tasks": "PickXtimes", "settings": "direct,explicit", "episodes": "3"} | options
    return make_plan(["random"], **chosen)


def test_a_seed_says_nothing_about_the_episode_without_the_secret():
    scenes = [get_episode("PickXtimes", "test", index).seed for index in range(SIZES["test"])]
    known = {episode_policy_seed(0, scene): scene for scene in scenes}
    assert len(known) == len(scenes)
    secret = {episode_policy_seed(0, scene, "of the run") for scene in scenes}
    assert len(secret) == len(scenes)
    assert not secret & known.keys()


def test_a_run_draws_its_secret_once(tmp_path):
    first, other = with_secret(a_plan(), tmp_path / "a"), with_secret(a_plan(), tmp_path / "b")
    assert len(first.seed_secret) == 32
    assert first.seed_secret != other.seed_secret
    (tmp_path / "a").mkdir()
    write_plan(first, tmp_path / "a")
    resumed = with_secret(a_plan(episodes="5"), tmp_path / "a")
    assert resumed.seed_secret == first.seed_secret
    shard = with_secret(read_plan(tmp_path / "a"), tmp_path / "c")
    assert shard.seed_secret == first.seed_secret
    assert episode_runner(shard, tmp_path / "c").seed_secret == first.seed_secret


def test_a_run_that_began_without_a_secret_goes_on_without(tmp_path):
    write_plan(a_plan(), tmp_path)
    assert with_secret(a_plan(), tmp_path).seed_secret == ""


def test_settings_and_forms_of_a_scene_share_the_seed_and_scenes_do_not():
    jobs = a_plan(forms="implicit,resolved").jobs()
    seeds = {(job.episode, load_policy(PreparedJob(job), "secret").seed) for job in jobs}
    assert len(jobs) == 9
    assert len(seeds) == 3


@pytest.mark.parametrize("settings", ["all", "explicit,spatial,direct"])
def test_what_names_the_goal_comes_after_what_does_not(settings):
    plan = a_plan(tasks="BinFill", settings=settings, forms="resolved,implicit", policy_seeds="0,1")
    for episode in range(3):
        said = [
            one.setting == "explicit" or one.form == "resolved"
            for one in plan.jobs()
            if one.episode == episode
        ]
        assert said == sorted(said)
        assert {True, False} == set(said)
