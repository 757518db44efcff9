"""Policies' seeds: from policy seed and scene alone; and no command of a scene is heard early."""

import pytest

from roboirg.runs.job_instruction import PreparedJob, episode_policy_seed
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.play.rollout import load_policy
from roboirg.tasks.splits.splits import get_episode


def test_a_policy_draws_anew_in_each_scene_seed_and_repetition():
    """The arm *again* repeats an episode."""
    seeds = set()
    for index in range(50):
        scene = get_episode("PickXtimes", "test", index).seed
        for policy_seed in (0, 1):
            seeds.add(episode_policy_seed(policy_seed, scene, "told"))
            seeds.add(episode_policy_seed(policy_seed, scene, "again"))

    assert len(seeds) == 50 * 2 * 2


@pytest.mark.parametrize("arm", ["other-goal", "silent", "paraphrase-1"])
def test_a_policy_draws_alike_in_arms_that_change_the_words_alone(arm):
    """Nothing else may differ."""
    assert episode_policy_seed(0, 1234, arm) == episode_policy_seed(0, 1234, "told")


def test_a_policy_draws_alike_in_all_settings_and_forms_of_a_scene():
    """So that a gap between settings is due to words. Three scenes in three tellings each."""
    plan = make_plan(
        ["random"], tasks="PickXtimes", settings="direct,explicit", episodes="3",
        forms="implicit,resolved",
    )  # fmt: skip
    jobs = plan.jobs()

    seeds = {(job.episode, load_policy(PreparedJob(job)).seed) for job in jobs}

    assert len(jobs) == 9
    assert len(seeds) == 3
