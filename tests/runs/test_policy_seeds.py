"""Policies' seeds: from policy seed and scene alone; and no command of a scene is heard early."""

from roboirg.runs.job_instruction import PreparedJob, episode_policy_seed
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.play.rollout import load_policy
from roboirg.tasks.splits.splits import SIZES, get_episode


def a_plan(**options):
    chosen = {"tasks": "PickXtimes", "settings": "direct,explicit", "episodes": "3"} | options
    return make_plan(["random"], **chosen)


def test_every_scene_policy_seed_and_only_the_arm_again_have_a_seed_of_their_own():
    scenes = [get_episode("PickXtimes", "test", index).seed for index in range(SIZES["test"])]
    cases = [(seed, scene, arm) for seed in (0, 1) for scene in scenes for arm in ("told", "again")]

    assert len({episode_policy_seed(*case) for case in cases}) == len(cases)
    for arm in ("other-goal", "silent", "paraphrase-1"):
        assert episode_policy_seed(0, scenes[0], arm) == episode_policy_seed(0, scenes[0])


def test_settings_and_forms_of_a_scene_share_the_seed_and_scenes_do_not():
    jobs = a_plan(forms="implicit,resolved").jobs()
    seeds = {(job.episode, load_policy(PreparedJob(job)).seed) for job in jobs}

    assert len(jobs) == 9
    assert len(seeds) == 3
