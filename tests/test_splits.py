"""The splits: seeds by the rule, and episodes that stay what they are."""

import dataclasses
import json
from collections import Counter

import numpy as np
import pytest

from roboirg.core.episode import SPLITS, Episode
from roboirg.core.errors import InvalidValueError, SceneRejectedError, UnknownNameError
from roboirg.episodes import splits
from roboirg.episodes.fingerprint import fingerprint, plain
from roboirg.episodes.splits import (
    MAX_REJECTED,
    SEED_STRIDE,
    SIZES,
    TaskSplits,
    base_seed,
    fingerprint_of,
    get_episode,
    shipped_splits,
    splits_text,
)
from roboirg.tasks import every_task, get_task

TASKS = tuple(every_task())
each_task = pytest.mark.parametrize("task", TASKS)


def episodes(task):
    return [get_episode(task, split, index) for split in SPLITS for index in range(SIZES[split])]


def test_every_task_s_splits_are_shipped():
    assert tuple(shipped_splits()) == TASKS


@each_task
def test_no_task_s_episodes_have_drifted(task):
    assert (
        fingerprint_of(task, shipped_splits()[task].passed_over) == shipped_splits()[task].sha256
    ), (
        f"The episodes of {task} are not those for which the splits were built; if that is wanted, "
        f"run: roboirg build-splits --tasks {task} --out src/roboirg/episodes/splits.json"
    )
    assert fingerprint(episodes(task)) == shipped_splits()[task].sha256


@each_task
def test_difficulties_follow_the_cycle_and_seeds_the_rule(task):
    for episode in episodes(task):
        assert episode.difficulty == ("easy", "easy", "medium", "hard")[episode.index % 4]
        first = base_seed(get_task(task), episode.split) + 100 * episode.index
        passed_over = shipped_splits()[task].passed_over.get(f"{episode.split}/{episode.index}", 0)
        assert episode.seed == first + passed_over
    counts = Counter(episode.difficulty for episode in episodes(task) if episode.split == "test")
    assert counts == {"easy": 26, "medium": 12, "hard": 12}


@each_task
def test_counts_are_of_episodes_that_exist_and_stay_below_the_next_one_s_seeds(task):
    keys = {f"{split}/{index}" for split in SPLITS for index in range(SIZES[split])}
    assert set(shipped_splits()[task].passed_over) <= keys
    assert all(0 < count <= MAX_REJECTED for count in shipped_splits()[task].passed_over.values())
    assert MAX_REJECTED < SEED_STRIDE


@each_task
def test_seeds_are_unique_over_all_splits(task):
    seeds = [episode.seed for episode in episodes(task)]
    assert len(set(seeds)) == len(seeds)


def test_a_fingerprint_tells_small_changes_but_not_the_last_bits():
    episode = get_episode("PickXtimes", "test", 3)
    first, *others = episode.scene.objects

    def turned(by: float) -> Episode:
        nudged = dataclasses.replace(first, yaw=first.yaw + by)
        return dataclasses.replace(
            episode, scene=dataclasses.replace(episode.scene, objects=(nudged, *others))
        )

    assert fingerprint([turned(1e-8)]) != fingerprint([episode])
    # Mathematics libraries differ by as much.
    assert fingerprint([turned(1e-14)]) == fingerprint([episode])
    assert fingerprint([episode]) == fingerprint([get_episode("PickXtimes", "test", 3)])
    other = get_episode("PickXtimes", "test", 2)
    assert fingerprint([episode, other]) != fingerprint([other, episode])


def test_only_plain_data_has_a_fingerprint():
    episode = get_episode("VideoUnmask", "test", 0)
    assert json.loads(json.dumps(plain(episode))) == plain(episode)
    for wrong in (np.float64(1.0), np.int64(1), [1], {1}):
        with pytest.raises(TypeError, match="is not plain data"):
            plain((wrong,))


def test_the_file_reads_back_and_has_a_line_for_each_task():
    splits = {"A": TaskSplits("0f", {"train/3": 2}), "B": TaskSplits("ff", {})}
    text = splits_text(splits)
    assert len(text.splitlines()) == 4
    assert {task: TaskSplits(**entry) for task, entry in json.loads(text).items()} == splits


def test_wrong_names_and_numbers_are_named_with_what_would_be_right():
    with pytest.raises(UnknownNameError, match=r"no task 'PickXTime'.*PickXtimes.*Did you mean"):
        get_episode("PickXTime", "test", 0)
    with pytest.raises(UnknownNameError, match=r"no split 'dev'.*train, val, test"):
        get_episode("PickXtimes", "dev", 0)
    assert get_episode("PickXtimes", "test", np.int64(3)) == get_episode("PickXtimes", "test", 3)
    for wrong in (-1, 50, 1.0, "0", True):
        with pytest.raises(InvalidValueError, match="has episodes 0 to 49"):
            get_episode("PickXtimes", "test", wrong)


def test_a_task_without_shipped_seeds_passes_over_those_without_a_scene(monkeypatch):
    task = get_task("PickXtimes")
    first = splits.slot_seed(task, "val", 7)

    def sample(rng, difficulty):
        seed = rng.bit_generator.seed_seq.entropy
        if seed < first + 3:
            raise SceneRejectedError("no room")
        return task.sample(rng, difficulty)

    picky = dataclasses.replace(task, name="Picky", sample=sample)
    monkeypatch.setattr(splits, "get_task", lambda _name: picky)
    assert splits.get_episode("Picky", "val", 7).seed == first + 3
