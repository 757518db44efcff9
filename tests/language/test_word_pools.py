"""Pools of words: chosen by the split or by an option."""

from dataclasses import replace

import pytest
from language_variants import TASKS
from page_text import call, words

from roboirg.core.episode import SPLITS
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import POOLS, pool_of
from roboirg.language import expressible, instruct, instruct_with, plain_settings
from roboirg.tasks.splits.splits import get_episode


def test_val_episodes_use_the_words_of_training_and_test_episodes_their_own():
    """A pool is a set of wordings; policies never see the words of the pool "test" in training."""
    assert {split: pool_of(split) for split in SPLITS} == {
        "train": "train",
        "val": "train",
        "test": "test",
    }


@pytest.mark.parametrize("pool", POOLS)
@pytest.mark.parametrize("setting", plain_settings())
def test_choosing_a_pool_gives_the_words_of_a_split_that_uses_it(setting, pool):
    """A pool is a set of wordings, "train" or "test"; the scene of the episode stays."""
    split = {"train": "val", "test": "test"}[pool]
    for task in TASKS:
        episode = get_episode(task, "test", 2)
        if setting not in expressible(episode, wordings=pool):
            continue
        said = instruct(episode, setting, wordings=pool)
        assert (said.metadata["pool"], said.metadata["wordings"]) == (pool, pool)
        assert said.metadata["command"] == "own"
        # The same scene as an episode of the split that has this pool by default.
        own = instruct(replace(episode, split=split), setting)
        assert (said.turns, said.metadata) == (own.turns, {**own.metadata, "wordings": pool})


@pytest.mark.parametrize("pool", POOLS)
def test_the_commands_show_and_run_accept_a_pool_of_wordings(pool, tmp_path):
    episode = get_episode("StopCube", "test", 0)
    expected = instruct_with(episode, InstructionOptions(wordings=pool)).text
    assert expected in words(call("show", "StopCube", "0", "--words", "--wordings", pool))

    run = ("run", "--policy", "random", "--out", str(tmp_path / "run"), "--dry-run")
    assert "1 episode" in call(
        *run, "--tasks", "StopCube", "--settings", "direct", "--episodes", "1",
        *("--policy-seeds", "0", "--wordings", pool),
    )  # fmt: skip
