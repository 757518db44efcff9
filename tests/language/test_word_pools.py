"""Pools of wordings: disjoint, large enough, chosen by the split or by an option."""

import functools
import itertools
import re
from collections import Counter
from dataclasses import replace

import pytest
from language_variants import TASKS, split_episodes
from plan_files import plan_file
from selection import slow_but
from typer.testing import CliRunner

from roboirg import main as cli
from roboirg.apps.language_lab.validation.validation_run import Batch, validate_batch
from roboirg.core.episode import SPLITS
from roboirg.core.word_pools import POOLS, Pools, pool_of
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.play.job_instruction import instruct_job
from roboirg.language import instruct, plain_settings
from roboirg.language.settings import all_settings
from roboirg.language.slot_types.number import SAME_NUMBER
from roboirg.language.templates import derivations, introductions, remarks
from roboirg.language.variants import instructions
from roboirg.tasks import all_tasks, every_task
from roboirg.tasks.splits.splits import get_episode

KINDS = {
    name: pools
    for module in (introductions, remarks, derivations)
    for name, pools in vars(module).items()
    if isinstance(pools, Pools)
}
IMPLICIT = tuple(name for name in plain_settings() if all_settings()[name].implicit)

OF_VERSION_1 = {
    "COLOR_INTRODUCTIONS": 4, "NUMBER_INTRODUCTIONS": 4, "AMOUNT_INTRODUCTIONS": 4,
    "REFERENCE_AMOUNT_INTRODUCTIONS": 3, "VISIT_INTRODUCTIONS": 3, "PLACEMENT_INTRODUCTIONS": 3,
    "MOMENT_INTRODUCTIONS": 3, "PLACE_INTRODUCTIONS": 12, "EXCLUDED_INTRODUCTIONS": 4,
    "SINGLED_INTRODUCTIONS": 3, "TWO_MOMENTS_INTRODUCTIONS": 3, "NEIGHBOR_INTRODUCTIONS": 3,
    "COLOR_REINFORCEMENTS": 4, "NUMBER_REINFORCEMENTS": 3, "VISIT_REINFORCEMENTS": 3,
    "VIDEO_REINFORCEMENTS": 3, "NEUTRAL_DISTRACTORS": 24, "COMPETING_COLOR_DISTRACTORS": 3,
    "COMPETING_NUMBER_DISTRACTORS": 3, "COMPETING_VISIT_DISTRACTORS": 3,
    "COMPETING_PLACEMENT_DISTRACTORS": 3, "COMPETING_MOMENT_DISTRACTORS": 3, "CUES": 5,
}  # fmt: skip
"""Templates of the version before the pools, by kind; places had four kinds of their own."""


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


def test_no_words_for_the_same_number_are_in_both_pools():
    assert not set(SAME_NUMBER.train) & set(SAME_NUMBER.test)


@pytest.mark.parametrize("name", OF_VERSION_1)
def test_there_are_twice_as_many_templates_as_before_the_pools(name):
    assert len(list(KINDS[name].everything)) >= 2 * OF_VERSION_1[name]


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
    for split, setting in itertools.product(SPLITS, plain_settings()):
        said = instruct(get_episode("PickXtimes", split, 1), setting)
        assert said.metadata["pool"] == pool_of(split)
        assert said.metadata["wordings"] is None
        other = instruct(get_episode("PickXtimes", split, 1), setting, wordings=pool_of(split))
        assert other.turns == said.turns
        assert other.metadata == {**said.metadata, "wordings": pool_of(split)}


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
        assert said.turns == instruct(replace(episode, split=split), setting).turns
        assert any(
            re.fullmatch(re.sub(r"\\{.*?\\}", ".*", re.escape(one.text)), said.command)
            for one in every_task()[task].commands.wordings.of(pool)
        ), said.command


@functools.cache
def implicit_texts(setting):
    """The texts of the implicit form, by split."""
    found = {split: set() for split in SPLITS}
    for task in TASKS:
        for episode, said in instructions(split_episodes(task), [setting], ["implicit"]):
            found[episode.split].add(said.text)
    return found


@pytest.mark.parametrize("setting", IMPLICIT)
def test_no_text_of_the_test_split_is_in_training(setting):
    texts = implicit_texts(setting)
    assert len(texts["test"]) >= 40 * sum(
        setting in {one.name for one in all_settings().values() if one.applies_to(task)}
        for task in every_task().values()
    )
    assert not texts["test"] & (texts["train"] | texts["val"])


@pytest.mark.parametrize("setting", IMPLICIT)
def test_every_setting_begins_in_many_ways(setting):
    texts = set().union(*implicit_texts(setting).values())
    openings = {tuple(re.findall(r"[\w']+", text.lower())[:3]) for text in texts}
    assert len(openings) >= 60


@pytest.mark.parametrize("pool", POOLS)
@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("episodes", slow_but([3], [3, 12]))
def test_every_split_is_valid_in_the_words_of_either_pool(task, pool, episodes):
    for split in ("train", "test"):
        found = validate_batch(Batch(task, split, 0, episodes, wordings_file=pool))
        assert not found.failures
        # With a rival, too, where there is one.
        assert 2 * episodes <= found.texts[task, "direct"] <= 4 * episodes


@pytest.mark.parametrize("pool", POOLS)
def test_a_plan_takes_a_pool_in_the_place_of_a_file(pool):
    plan = make_plan(["random"], tasks="PickXtimes", settings="direct", episodes="2", wordings=pool)
    (job, *_) = plan.jobs()
    assert (job.options.wordings, job.wordings_file) == (pool, pool)
    said = instruct_job(job)
    assert said.metadata["pool"] == pool
    assert said.text == instruct(get_episode("PickXtimes", "test", 0), "direct", wordings=pool).text


def call(*words):
    result = CliRunner().invoke(cli.app, words, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return " ".join(result.output.split())


@pytest.mark.parametrize("pool", POOLS)
def test_the_commands_take_a_pool(pool, tmp_path):
    episode = get_episode("StopCube", "test", 0)
    expected = instruct(episode, wordings=pool).text
    assert expected in call("show", "StopCube", "0", "--words", "--wordings", pool)
    out = tmp_path / "rows.jsonl"
    words = ("--settings", "explicit", "--split", "val")
    plan = plan_file(wordings=pool, forms="implicit")
    call("export", "instructions", "--out", str(out), *words, "--plan", plan)
    rows = out.read_text().splitlines()
    assert len(rows) == 50 * len(all_tasks())
    run = ("run", "--policy", "random", "--out", str(tmp_path / "run"), "--dry-run")
    assert "1 episode" in call(
        *run, "--tasks", "StopCube", "--settings", "direct", "--episodes", "1",
        *("--policy-seeds", "0", "--wordings", pool),
    )  # fmt: skip
