"""Pools of wordings: disjoint, large enough, chosen by the split or by an option."""

import itertools
import re
from collections import Counter
from dataclasses import replace

import pytest
from language_variants import TASKS, split_episodes
from page_text import call, words

from roboirg.apps.language_lab.validation.episode_checks import check_place
from roboirg.core.episode import SPLITS
from roboirg.core.word_pools import POOLS, Pools, pool_of
from roboirg.language import instruct, plain_settings
from roboirg.language.grounded import grounded_templates
from roboirg.language.rivals import rival_templates
from roboirg.language.settings import all_settings
from roboirg.language.slot_types import number
from roboirg.language.templates import derivations, introductions, remarks
from roboirg.language.variants import instructions
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode


def pools_in(name, value):
    """Yield every pool in the values of a module, with its name."""
    if isinstance(value, Pools):
        yield name, value
    elif isinstance(value, dict | tuple) and name not in ("OTHERS", "__builtins__"):
        for part, one in value.items() if isinstance(value, dict) else enumerate(value):
            yield from pools_in(f"{name}-{part}", one)


KINDS = {
    found: pools
    for module in (introductions, remarks, derivations, rival_templates, grounded_templates, number)
    for name, value in vars(module).items()
    for found, pools in pools_in(name, value)
}
IMPLICIT = tuple(name for name in plain_settings() if all_settings()[name].implicit)


def words_of(template):
    found = template if isinstance(template, tuple) else (getattr(template, "text", template),)
    return " ".join(map(str, found)).lower()


@pytest.mark.parametrize("name", KINDS)
def test_no_template_is_in_both_pools(name):
    pools = KINDS[name]
    train, test = (set(map(words_of, pools.of(pool))) for pool in POOLS)
    assert train
    assert test
    assert not train & test
    assert len(list(pools.everything)) == len(pools.train) + len(pools.test)


def test_the_pools_of_every_module_are_found():
    assert len(KINDS) >= 50
    assert {"CUES", "SAME_NUMBER", "SINGLED"} <= KINDS.keys()


@pytest.mark.parametrize("task", every_task().values(), ids=lambda task: task.name)
def test_no_command_is_in_both_pools_and_there_are_three_of_each(task):
    wordings = task.commands.wordings
    assert not {one.text for one in wordings.train} & {one.text for one in wordings.test}
    for pool in POOLS:
        by_parts = Counter(one.parts for one in wordings.of(pool))
        assert set(by_parts.values()) == {3}, pool


def test_the_split_chooses_the_pool():
    assert {split: pool_of(split) for split in SPLITS} == {
        "train": "train",
        "val": "train",
        "test": "test",
    }


@pytest.mark.parametrize("pool", POOLS)
@pytest.mark.parametrize("setting", plain_settings())
def test_a_pool_may_be_chosen(setting, pool):
    """The words are those of an episode of a split with that pool, with the same scene."""
    split = {"train": "val", "test": "test"}[pool]
    for task in TASKS:
        episode = get_episode(task, "test", 2)
        if setting not in {
            one.setting for _, one in instructions([episode], [setting], ["implicit"])
        }:
            continue
        said = instruct(episode, setting, wordings=pool)
        assert (said.metadata["pool"], said.metadata["wordings"]) == (pool, pool)
        assert said.metadata["command"] == "own"
        own = instruct(replace(episode, split=split), setting)
        assert (said.turns, said.metadata) == (own.turns, {**own.metadata, "wordings": pool})
        assert any(
            re.fullmatch(re.sub(r"\\{.*?\\}", ".*", re.escape(one.text)), said.command)
            for one in every_task()[task].commands.wordings.of(pool)
        ), said.command


@pytest.mark.parametrize("setting", IMPLICIT)
def test_no_text_of_the_test_split_is_in_training(setting):
    texts = {split: set() for split in SPLITS}
    for task in TASKS:
        some = itertools.islice(split_episodes(task), 0, None, 11)
        for episode, said in instructions(some, [setting], ["implicit"]):
            texts[episode.split].add(said.text)
    assert len(texts["test"]) >= 4 * sum(
        setting in {one.name for one in all_settings().values() if one.applies_to(task)}
        for task in every_task().values()
    )
    assert not texts["test"] & (texts["train"] | texts["val"])


@pytest.mark.parametrize("task", TASKS)
def test_every_split_is_valid_in_the_words_of_the_other_pool(task):
    for split, pool in (("train", "test"), ("test", "train")):
        found = check_place((task, split, 2), pool)
        assert not found.failures
        assert found.texts[task, "direct"] == 2


@pytest.mark.parametrize("pool", POOLS)
def test_the_commands_take_a_pool(pool, tmp_path):
    episode = get_episode("StopCube", "test", 0)
    expected = instruct(episode, wordings=pool).text
    assert expected in words(call("show", "StopCube", "0", "--words", "--wordings", pool))
    run = ("run", "--policy", "random", "--out", str(tmp_path / "run"), "--dry-run")
    assert "1 episode" in call(
        *run, "--tasks", "StopCube", "--settings", "direct", "--episodes", "1",
        *("--policy-seeds", "0", "--wordings", pool),
    )  # fmt: skip
