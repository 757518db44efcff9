"""The splits: published and sampled episodes, which stay what they are."""

import dataclasses
import json

import numpy as np
import pytest

from roboirg.core.episode import SPLITS
from roboirg.core.errors import InvalidValueError, SceneRejectedError, UnknownNameError
from roboirg.tasks import all_tasks, every_task, get_task
from roboirg.tasks.splits import splits
from roboirg.tasks.splits.fingerprint import fingerprint, plain
from roboirg.tasks.splits.published_episodes import published_episode
from roboirg.tasks.splits.recordings import is_recorded
from roboirg.tasks.splits.splits import (
    MAX_REJECTED,
    SEED_STRIDE,
    get_episode,
    shipped_splits,
    slot_seed,
    split_episodes,
)

TASKS = tuple(every_task())
each_task = pytest.mark.parametrize("task", TASKS)


def episodes_of(task):
    return list(split_episodes([task], SPLITS))


def published(episode):
    """Return what RoboMME has published for an episode, or None."""
    return published_episode(episode.task, episode.split, episode.index)


def test_every_task_has_its_splits_in_the_shipped_file():
    assert tuple(shipped_splits()) == TASKS


@each_task
def test_the_episodes_of_each_task_are_still_those_of_the_shipped_fingerprint(task):
    assert fingerprint(episodes_of(task)) == shipped_splits()[task].sha256, (
        f"The episodes of {task} are not those for which the splits were built; if that is wanted, "
        f"run: python scripts/build_splits.py --tasks {task}"
    )


@pytest.mark.parametrize(
    ("task", "digest"),
    [
        ("PickXtimes", "6941ffb1f20b"),
        ("StopCube", "f00cf213c7b4"),
        ("SwingXtimes", "673140b89afa"),
        ("BinFill", "c1ad6e181111"),
        ("VideoUnmaskSwap", "970a2412db9b"),
        ("VideoUnmask", "ea82cdea53d5"),
        ("ButtonUnmaskSwap", "ba0ba0a3628b"),
        ("ButtonUnmask", "e4c6684c5748"),
        ("VideoRepick", "2229d836d499"),
        ("VideoPlaceButton", "1d05e5284f56"),
        ("VideoPlaceOrder", "d78517b2ed85"),
        ("PutInBox", "90bf26fade86"),
        ("PickByCount", "4fc73753291f"),
    ],
    ids=TASKS,
)
def test_the_first_40_random_episodes_of_each_task_are_what_they_were(task, digest):
    """They are drawn anew: a changed figure of a sampler, such as a region, shows here."""
    drawn = [get_episode(task, "random", index) for index in range(40)]

    assert fingerprint(drawn)[:12] == digest, "new scenes need a new environment version"


@pytest.mark.parametrize("task", all_tasks())
def test_episodes_that_robomme_has_published_are_its_own(task):
    """RoboMME is the benchmark of whose tasks this one is made."""
    for episode in episodes_of(task):
        found = published(episode)
        if found is not None:
            assert found == (episode.seed, episode.difficulty, episode.scene, episode.goal)
            assert episode.recorded == is_recorded(task, episode.split, episode.index)


def test_all_episodes_of_the_benchmark_are_published_but_for_the_few_robomme_cannot_build():
    """The fixed splits are RoboMME's. Six of its episodes, named by task, split and number, cannot
    be built there, so the benchmark samples its own."""
    sampled = []
    for task in all_tasks():
        sampled += [episode.key for episode in episodes_of(task) if published(episode) is None]

    assert sorted(sampled) == [
        "VideoPlaceButton/val/15",
        "VideoPlaceOrder/train/38",
        "VideoPlaceOrder/train/7",
        "VideoPlaceOrder/train/75",
        "VideoPlaceOrder/val/34",
        "VideoPlaceOrder/val/43",
    ]


def episodes_of_our_own(task):
    """Return the episodes of the fixed splits that RoboMME has not published."""
    return [episode for episode in episodes_of(task) if published(episode) is None]


@each_task
def test_episodes_of_our_own_repeat_easy_easy_medium_hard(task):
    """Where RoboMME has published no episode of a split, the benchmark samples one, whose
    difficulty follows from its number."""
    for episode in episodes_of_our_own(task):
        assert episode.difficulty == ("easy", "easy", "medium", "hard")[episode.index % 4]


@each_task
def test_episodes_of_our_own_have_the_first_seed_of_their_range_that_gives_a_scene(task):
    """Each sampled episode has a range of seeds, from `slot_seed` on. The shipped file of splits
    has, as `passed_over`, how many of them give no scene; the one after these must be taken."""
    passed_over = shipped_splits()[task].passed_over
    for episode in episodes_of_our_own(task):
        first = slot_seed(get_task(task), episode.split, episode.index)
        without_scene = passed_over.get(f"{episode.split}/{episode.index}", 0)
        assert episode.seed == first + without_scene


@each_task
def test_episodes_of_our_own_are_not_among_robomme_s_recorded_ones(task):
    """RoboMME has recorded what it has published, and nothing that this benchmark has sampled."""
    assert not any(episode.recorded for episode in episodes_of_our_own(task))


@pytest.mark.parametrize("task", ["PickXtimes", "StopCube"])
@pytest.mark.parametrize(
    ("index", "difficulty"),
    [(0, "easy"), (1, "easy"), (2, "medium"), (3, "hard"), (999_999, "hard")],
)
def test_random_episodes_repeat_the_difficulties_and_have_seeds_of_their_own_range(
    task, index, difficulty
):
    """The split *random* has no end; the difficulty of an episode follows from its number, modulo
    4. Each has a range of seeds, so that no two share one, and is the same whenever it is made."""
    episode = get_episode(task, "random", index)

    first = slot_seed(get_task(task), "random", index)
    assert episode.difficulty == difficulty
    assert first <= episode.seed < first + SEED_STRIDE
    assert episode == get_episode(task, "random", index)


@each_task
def test_seeds_passed_over_are_of_our_own_episodes_and_never_reach_the_next_ones_range(task):
    """For each episode that the benchmark samples, the shipped file of splits may have how many
    seeds give no scene. There are fewer of these than seeds before the next episode's."""
    own = {f"{episode.split}/{episode.index}" for episode in episodes_of_our_own(task)}

    passed_over = shipped_splits()[task].passed_over

    assert passed_over.keys() <= own
    assert all(0 < count <= MAX_REJECTED < SEED_STRIDE for count in passed_over.values())


@each_task
def test_seeds_are_unique_over_all_splits(task):
    seeds = [episode.seed for episode in episodes_of(task)]
    assert len(set(seeds)) == len(seeds)
    assert max(seeds) < slot_seed(get_task(task), "random", 0)


def episode_with_a_thing_turned(angle):
    """Return an episode whose first thing is turned by an angle in radians."""
    episode = get_episode("PickXtimes", "test", 3)
    first, *others = episode.scene.objects
    turned = dataclasses.replace(first, yaw=first.yaw + angle)
    scene = dataclasses.replace(episode.scene, objects=(turned, *others))
    return dataclasses.replace(episode, scene=scene)


def test_a_fingerprint_of_episodes_changes_with_a_small_turn_but_not_with_rounding():
    """Mathematics libraries differ by some 1e-14."""
    usual = fingerprint([episode_with_a_thing_turned(0)])

    assert fingerprint([episode_with_a_thing_turned(1e-8)]) != usual
    assert fingerprint([episode_with_a_thing_turned(1e-14)]) == usual


def test_a_fingerprint_of_episodes_depends_on_their_order():
    first = get_episode("PickXtimes", "test", 2)
    second = get_episode("PickXtimes", "test", 3)

    assert fingerprint([first, second]) != fingerprint([second, first])


def test_what_a_fingerprint_is_made_of_is_the_same_after_json():
    data = plain(get_episode("VideoUnmask", "test", 0))

    assert json.loads(json.dumps(data)) == data


@pytest.mark.parametrize("wrong", [np.float64(1.0), np.int64(1), [1], {1}], ids=repr)
def test_only_plain_data_has_a_fingerprint(wrong):
    with pytest.raises(TypeError, match="is not plain data"):
        plain((wrong,))


@pytest.mark.parametrize(
    ("task", "split", "words"),
    [
        ("PickXTime", "test", r"no task 'PickXTime'.*PickXtimes.*Did you mean"),
        ("PickXtimes", "dev", r"no split 'dev'.*train, val, test, random"),
    ],
)
def test_an_unknown_task_or_split_is_refused_with_those_that_exist(task, split, words):
    with pytest.raises(UnknownNameError, match=words):
        get_episode(task, split, 0)


@pytest.mark.parametrize("index", [-1, 50, 1.0, "0", True])
def test_an_episode_that_is_no_number_of_its_split_is_refused(index):
    with pytest.raises(InvalidValueError, match="has episodes 0 to 49"):
        get_episode("PickXtimes", "test", index)


def test_an_episode_may_be_a_number_of_numpy():
    assert get_episode("PickXtimes", "test", np.int64(3)) == get_episode("PickXtimes", "test", 3)


def test_the_random_split_is_none_of_those_with_a_fixed_number_of_episodes():
    with pytest.raises(UnknownNameError, match=r"no split 'random'.*train, val, test"):
        splits.check_fixed_split("random")


def test_an_episode_of_a_new_task_takes_the_first_seed_for_which_a_scene_can_be_made(monkeypatch):
    """For the first three seeds there is no room on the table."""
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
