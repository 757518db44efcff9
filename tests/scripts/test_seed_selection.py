"""The shipped splits are what the rule gives: scene, words and oracle agree."""

import dataclasses

import pytest
from seed_selection import (
    EpisodeSlot,
    check_seed,
    check_words,
    episode_slots,
    find_seed,
)

from roboirg.core.episode import SPLITS
from roboirg.language import expressible
from roboirg.language.settings import all_settings, plain_settings, settings_of
from roboirg.tasks import every_task, get_task
from roboirg.tasks.splits.splits import SIZES, get_episode, shipped_splits

each_task = pytest.mark.parametrize("task", every_task())


@each_task
def test_the_plain_settings_can_be_expressed_in_every_third_episode(task):
    """A setting is a way of telling the goal; *plain* are those without a harder variant of them.

    All plain settings that a task has can tell the goal of its episodes 0, 3, 6, … of each split.
    """
    plain = set(plain_settings()) & set(settings_of(get_task(task)))
    for split in SPLITS:
        for index in range(0, SIZES[split], 3):
            missing = plain - set(expressible(get_episode(task, split, index)))
            assert missing == set(), f"{task}/{split}/{index}"


def test_the_scenes_and_words_of_today_reject_the_seeds_that_the_shipped_file_says():
    """An episode takes the first seed whose scene has room and whose goal the words can express.

    The shipped file has, for each task, how many seeds were passed over before that one. All are
    searched again, without the simulator. Only one episode did not take its first seed: for
    val/34 of VideoPlaceOrder three were passed over.
    """
    passed_over = {task: {} for task in every_task()}
    for slot in episode_slots(every_task()):
        rejections = find_seed(slot, check_words).rejections
        if rejections:
            passed_over[slot.task][f"{slot.split}/{slot.index}"] = len(rejections)

    shipped = {task: entry.passed_over for task, entry in shipped_splits().items()}
    assert shipped == passed_over
    assert shipped["VideoPlaceOrder"] == {"val/34": 3}


@pytest.mark.sim
@pytest.mark.parametrize(
    ("slot", "passed_over"),
    [
        (EpisodeSlot("PutInBox", "test", 49), 0),
        (EpisodeSlot("VideoPlaceOrder", "val", 34), 3),
    ],
    ids=["first seed taken", "three passed over"],
)
def test_the_oracle_solves_the_first_seed_that_scene_and_words_allow(slot, passed_over):
    """A seed is taken if the oracle, a scripted policy that knows the goal, solves its episode too.

    The check with the oracle passes over as many seeds as the check of scene and words alone, so
    the oracle rejects none.
    """
    assert len(find_seed(slot, check_seed).rejections) == passed_over


@pytest.fixture
def mute(monkeypatch):
    """Register a setting that no episode can be expressed in."""
    setting = dataclasses.replace(
        all_settings()["direct"], name="mute", order=9, refusal=lambda _request: "it is mute"
    )
    settings = {**all_settings(), "mute": setting}
    for module in ("settings", "scenarios.spoken"):
        monkeypatch.setattr(f"roboirg.language.{module}.all_settings", lambda: settings)


def test_a_new_setting_does_not_change_which_seeds_are_accepted(mute):
    """The fixture adds a setting, *mute*, that refuses every episode. The first seed of the episode
    is accepted all the same: no seed is rejected before it."""
    selected = find_seed(EpisodeSlot("VideoUnmask", "val", 0), check_words)

    assert selected.rejections == ()


def test_only_episodes_that_are_not_published_need_a_seed():
    """RoboMME has published the seeds of its episodes: all of the task VideoUnmask, and all but one
    of VideoPlaceButton. PutInBox is a task of this benchmark alone: 100 episodes to train, 50 to
    validate and 50 to test need a seed."""
    assert episode_slots(["VideoUnmask"]) == ()
    assert episode_slots(["VideoPlaceButton"]) == (EpisodeSlot("VideoPlaceButton", "val", 15),)
    assert len(episode_slots(["PutInBox"])) == 100 + 50 + 50
