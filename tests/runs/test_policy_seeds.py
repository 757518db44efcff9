"""Policies' seeds: from policy seed and scene alone; and no command of a scene is heard early."""

from roboirg.runs.job_instruction import PreparedJob, episode_policy_seed
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.play.rollout import load_policy
from roboirg.tasks.splits.splits import SIZES, get_episode


def plan_with(**options):
    chosen = {"tasks": "PickXtimes", "settings": "direct,explicit", "episodes": "3"} | options
    return make_plan(["random"], **chosen)


def test_a_policy_draws_anew_in_each_scene_seed_and_repetition_but_not_in_other_arms():
    """The arm *again* repeats an episode; others change its words, and nothing else may differ."""
    scenes = [get_episode("PickXtimes", "test", index).seed for index in range(SIZES["test"])]
    cases = [(seed, scene, arm) for seed in (0, 1) for scene in scenes for arm in ("told", "again")]

    assert len({episode_policy_seed(*case) for case in cases}) == len(cases)
    for arm in ("other-goal", "silent", "paraphrase-1"):
        assert episode_policy_seed(0, scenes[0], arm) == episode_policy_seed(0, scenes[0])


def test_a_policy_draws_alike_in_all_settings_and_forms_of_a_scene():
    """So that a gap between settings is due to words. Three scenes in three tellings each."""
    jobs = plan_with(forms="implicit,resolved").jobs()
    seeds = {(job.episode, load_policy(PreparedJob(job)).seed) for job in jobs}

    assert len(jobs) == 9
    assert len(seeds) == 3
