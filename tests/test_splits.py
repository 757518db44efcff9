"""The splits: published and sampled episodes, which stay what they are."""

import dataclasses
import json

import numpy as np
import pytest

from roboirg.core.episode import SPLITS, Episode
from roboirg.core.errors import InvalidValueError, SceneRejectedError, UnknownNameError
from roboirg.tasks import all_tasks, every_task, get_task
from roboirg.tasks.splits import splits
from roboirg.tasks.splits.fingerprint import fingerprint, plain
from roboirg.tasks.splits.published_episodes import published_episode
from roboirg.tasks.splits.recordings import is_recorded
from roboirg.tasks.splits.splits import (
    MAX_REJECTED,
    SEED_STRIDE,
    TaskSplits,
    get_episode,
    shipped_splits,
    slot_seed,
    split_episodes,
    splits_text,
)

TASKS = tuple(every_task())
GAPS = {
    "VideoPlaceButton": {"VideoPlaceButton/val/15"},
    "VideoPlaceOrder": {
        *(f"VideoPlaceOrder/train/{index}" for index in (7, 38, 75)),
        *(f"VideoPlaceOrder/val/{index}" for index in (34, 43)),
    },
}
"""Episodes that RoboMME cannot build."""
RANDOM = {
    "PickXtimes": "6941ffb1f20b",
    "StopCube": "f00cf213c7b4",
    "SwingXtimes": "673140b89afa",
    "BinFill": "c1ad6e181111",
    "VideoUnmaskSwap": "970a2412db9b",
    "VideoUnmask": "ea82cdea53d5",
    "ButtonUnmaskSwap": "ba0ba0a3628b",
    "ButtonUnmask": "e4c6684c5748",
    "VideoRepick": "2229d836d499",
    "VideoPlaceButton": "1d05e5284f56",
    "VideoPlaceOrder": "d78517b2ed85",
    "PutInBox": "90bf26fade86",
    "PickByCount": "4fc73753291f",
}
"""Fingerprints, shortened, of the first random episodes of each task."""
each_task = pytest.mark.parametrize("task", TASKS)


def episodes(task):
    return list(split_episodes([task], SPLITS))


def slot(episode):
    return episode.task, episode.split, episode.index


def test_every_task_s_splits_are_shipped():
    assert tuple(shipped_splits()) == TASKS


@each_task
def test_no_task_s_episodes_have_drifted(task):
    assert fingerprint(episodes(task)) == shipped_splits()[task].sha256, (
        f"The episodes of {task} are not those for which the splits were built; if that is wanted, "
        f"run: python scripts/build_splits.py --tasks {task} "
        "--out src/roboirg/tasks/splits/splits.json"
    )


@each_task
def test_random_episodes_are_what_they_were(task):
    """They are drawn anew: a changed figure of a sampler, such as a region, shows here."""
    drawn = [get_episode(task, "random", index) for index in range(40)]
    assert fingerprint(drawn)[:12] == RANDOM[task], "new scenes need a new environment version"


@pytest.mark.parametrize("task", all_tasks())
def test_the_benchmark_s_episodes_are_robomme_s(task):
    sampled = [episode for episode in episodes(task) if published_episode(*slot(episode)) is None]
    assert {episode.key for episode in sampled} == GAPS.get(task, set())
    for episode in episodes(task):
        found = published_episode(*slot(episode))
        if found is not None:
            assert found == (episode.seed, episode.difficulty, episode.scene, episode.goal)
            assert episode.recorded == is_recorded(*slot(episode))


@each_task
def test_sampled_episodes_follow_the_cycle_and_the_rule_of_seeds(task):
    random = [get_episode(task, "random", index) for index in (0, 1, 2, 3, 999_999)]
    for episode in [*episodes(task), *random]:
        if published_episode(*slot(episode)):
            continue
        assert episode.difficulty == ("easy", "easy", "medium", "hard")[episode.index % 4]
        first = slot_seed(get_task(task), episode.split, episode.index)
        if episode.split == "random":
            assert first <= episode.seed < first + SEED_STRIDE
        else:
            key = f"{episode.split}/{episode.index}"
            assert episode.seed == first + shipped_splits()[task].passed_over.get(key, 0)
        assert not episode.recorded
    assert random[4] == get_episode(task, "random", 999_999)


@each_task
def test_counts_are_of_sampled_episodes_and_stay_below_the_next_one_s_seeds(task):
    sampled = {
        f"{episode.split}/{episode.index}"
        for episode in episodes(task)
        if published_episode(*slot(episode)) is None
    }
    assert set(shipped_splits()[task].passed_over) <= sampled
    assert all(0 < count <= MAX_REJECTED for count in shipped_splits()[task].passed_over.values())
    assert MAX_REJECTED < SEED_STRIDE


@each_task
def test_seeds_are_unique_over_all_splits(task):
    seeds = [episode.seed for episode in episodes(task)]
    assert len(set(seeds)) == len(seeds)
    assert max(seeds) < slot_seed(get_task(task), "random", 0)


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
    with pytest.raises(UnknownNameError, match=r"no split 'dev'.*train, val, test, random"):
        get_episode("PickXtimes", "dev", 0)
    assert get_episode("PickXtimes", "test", np.int64(3)) == get_episode("PickXtimes", "test", 3)
    with pytest.raises(UnknownNameError, match=r"no split 'random'.*train, val, test"):
        splits.check_fixed_split("random")
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

    picked = splits.get_episode("Picky", "val", 7)

    assert picked.seed == first + 3
