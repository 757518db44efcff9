"""The shipped splits are what the rule gives: scene, words and oracle agree."""

import dataclasses

import pytest
from seed_selection import (
    ACCEPTANCE_SETTINGS,
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
from roboirg.tasks.splits.splits import SIZES, get_episode, shipped_splits, slot_seed

TASKS = tuple(every_task())
each_task = pytest.mark.parametrize("task", TASKS)


def passed_over(slot):
    return shipped_splits()[slot.task].passed_over.get(f"{slot.split}/{slot.index}", 0)


def first_seed(slot):
    return slot_seed(get_task(slot.task), slot.split, slot.index)


@each_task
def test_every_setting_of_every_episode_can_be_expressed(task):
    for split in SPLITS:
        for index in range(SIZES[split]):
            refused = set(settings_of(get_task(task))) - set(
                expressible(get_episode(task, split, index))
            )
            assert not refused & set(plain_settings())


@each_task
def test_scene_and_words_allow_the_shipped_seeds_and_rule_out_no_more_than_were_passed_over(task):
    for slot in episode_slots([task]):
        ruled_out = len(find_seed(slot, check_words).rejections)
        assert ruled_out <= passed_over(slot)
        assert check_words(slot, first_seed(slot) + passed_over(slot)) is None


@pytest.mark.sim
@each_task
def test_the_rule_gives_the_shipped_seeds(task):
    """For a plain episode, and for one for which seeds were passed over."""
    slots = episode_slots([task])
    refused = [slot for slot in slots if passed_over(slot)]
    for slot in (*slots[:1], *refused[-1:]):
        assert len(find_seed(slot, check_seed).rejections) == passed_over(slot), slot.key


@pytest.mark.sim
@each_task
def test_seeds_passed_over_for_the_oracle_s_sake_had_to_be(task):
    """A seed that scene and words allow was only passed over if the oracle fails there."""
    allowed = [
        (slot, seed)
        for slot in episode_slots([task])
        for seed in range(first_seed(slot), first_seed(slot) + passed_over(slot))
        if check_words(slot, seed) is None
    ]
    for slot, seed in allowed[:2]:
        rejection = check_seed(slot, seed)
        assert rejection is not None, (slot.key, seed)
        assert rejection.reason == "oracle failed"


def test_a_new_setting_does_not_change_which_seeds_are_accepted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    slots = [EpisodeSlot("VideoUnmask", "val", index) for index in (0, 15)]
    before = [find_seed(slot, check_words) for slot in slots]
    mute = dataclasses.replace(
        all_settings()["direct"], name="mute", order=9, refusal=lambda _request: "it is mute"
    )
    every = {**all_settings(), "mute": mute}
    monkeypatch.setattr("roboirg.language.settings.all_settings", lambda: every)
    episode = get_episode("VideoUnmask", "val", 0)
    assert "mute" in settings_of(get_task("VideoUnmask"))
    assert "mute" not in expressible(episode)
    assert find_refusals(episode) == {"mute": "it is mute"}
    assert [find_seed(slot, check_words) for slot in slots] == before


def test_seeds_are_accepted_by_the_settings_of_the_first_release() -> None:
    assert set(ACCEPTANCE_SETTINGS) <= set(all_settings())
    assert [*ACCEPTANCE_SETTINGS] == ["explicit", "direct", "reasoning", "contextual", "spatial"]


def test_only_sampled_episodes_need_a_seed():
    assert episode_slots(["VideoUnmask"]) == ()
    assert episode_slots(["VideoPlaceButton"]) == (EpisodeSlot("VideoPlaceButton", "val", 15),)
    assert len(episode_slots(["PutInBox"])) == sum(SIZES[split] for split in SPLITS)
