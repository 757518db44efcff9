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
from roboirg.language import expressible, find_refusals
from roboirg.language.settings import all_settings, plain_settings, settings_of
from roboirg.tasks import every_task, get_task
from roboirg.tasks.splits.splits import SIZES, get_episode, shipped_splits

each_task = pytest.mark.parametrize("task", every_task())


@each_task
def test_the_plain_settings_can_be_expressed_in_every_third_episode(task):
    """Every plain setting that a task has, in words of any episode."""
    plain = set(plain_settings()) & set(settings_of(get_task(task)))
    for split in SPLITS:
        for index in range(0, SIZES[split], 3):
            missing = plain - set(expressible(get_episode(task, split, index)))
            assert missing == set(), f"{task}/{split}/{index}"


@each_task
def test_scene_and_words_rule_out_the_seeds_that_were_passed_over(task):
    """So far the oracle has solved what they allow; a seed passed over for its sake is played."""
    passed_over = {}
    for slot in episode_slots([task]):
        rejections = find_seed(slot, check_words).rejections
        if rejections:
            passed_over[f"{slot.split}/{slot.index}"] = len(rejections)

    assert passed_over == shipped_splits()[task].passed_over


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


def test_a_new_setting_that_refuses_an_episode_is_named_with_its_reason(mute):
    assert find_refusals(get_episode("VideoUnmask", "val", 0)) == {"mute": "it is mute"}


def test_a_new_setting_does_not_change_which_seeds_are_accepted(mute):
    """The first seed of the episode is accepted although the setting refuses it."""
    selected = find_seed(EpisodeSlot("VideoUnmask", "val", 0), check_words)

    assert selected.rejections == ()


def test_only_episodes_that_are_not_published_need_a_seed():
    """All of VideoUnmask are RoboMME's; of VideoPlaceButton all but one are; PutInBox is ours."""
    assert episode_slots(["VideoUnmask"]) == ()
    assert episode_slots(["VideoPlaceButton"]) == (EpisodeSlot("VideoPlaceButton", "val", 15),)
    assert len(episode_slots(["PutInBox"])) == 200
