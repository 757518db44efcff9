"""Pools of words: those of training and those of tests, chosen by the split or by an option."""

from dataclasses import replace

import pytest
from language_variants import TASKS
from page_text import call, words

from roboirg.core.episode import SPLITS
from roboirg.core.word_pools import pool_of
from roboirg.language import expressible, instruct, plain_settings
from roboirg.tasks.splits.splits import get_episode

each_pool = pytest.mark.parametrize("pool", ["train", "test"])


def test_val_episodes_use_the_words_of_training_and_test_episodes_their_own():
    """Policies never see the words of the pool "test" in training."""
    pools = {split: pool_of(split) for split in SPLITS}
    assert pools == {"train": "train", "val": "train", "test": "test"}


@pytest.mark.parametrize(("pool", "split"), [("train", "val"), ("test", "test")])
@pytest.mark.parametrize("setting", plain_settings())
def test_choosing_a_pool_gives_the_words_of_a_split_that_uses_it(setting, pool, split):
    """The scene of the episode stays, and is said as if it were one of the split."""
    for task in TASKS:
        episode = get_episode(task, "test", 2)
        if setting not in expressible(episode, wordings=pool):
            continue

        said = instruct(episode, setting, wordings=pool)

        of_split = instruct(replace(episode, split=split), setting)
        assert said.turns == of_split.turns
        assert said.metadata == {**of_split.metadata, "wordings": pool}


@each_pool
def test_the_command_show_accepts_a_pool_of_wordings(pool):
    """It prints the words of the pool for the same episode."""
    said = instruct(get_episode("StopCube", "test", 0), wordings=pool)

    printed = call("show", "StopCube", "0", "--words", "--wordings", pool)

    assert said.text in words(printed)
