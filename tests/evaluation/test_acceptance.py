"""The shipped splits are what the rule gives: scene, words and oracle agree."""

import pytest

from roboirg.episode import SPLITS
from roboirg.evaluation.acceptance import is_solved, sampled
from roboirg.language import expressible
from roboirg.splits import SIZES, get_episode, rejections, slot_seed
from roboirg.tasks import all_tasks, get_task

TASKS = tuple(all_tasks())


@pytest.mark.parametrize("task", TASKS)
def test_every_setting_of_every_episode_can_be_expressed(task):
    for split in SPLITS:
        for index in range(SIZES[split]):
            assert expressible(get_episode(task, split, index)) == get_task(task).settings


def test_every_seed_that_was_passed_over_had_to_be():
    assert rejections()
    for key, count in rejections().items():
        task, split, number = key.split("/")
        first = slot_seed(get_task(task), split, int(number))
        for seed in range(first, first + count):
            episode = sampled(task, seed, split, int(number))
            assert (
                episode is None
                or expressible(episode) != get_task(task).settings
                or not is_solved(episode)
            )


@pytest.mark.sim
@pytest.mark.parametrize("task", TASKS)
def test_the_oracle_solves_every_test_episode(task):
    solved = [is_solved(get_episode(task, "test", index)) for index in range(SIZES["test"])]
    assert sum(solved) >= 49


@pytest.mark.sim
@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("split", ["train", "val"])
def test_the_oracle_solves_a_sample_of_the_other_splits(task, split):
    assert all(is_solved(get_episode(task, split, index)) for index in range(0, SIZES[split], 11))
