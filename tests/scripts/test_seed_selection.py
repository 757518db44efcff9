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

TASKS = tuple(every_task())
each_task = pytest.mark.parametrize("task", TASKS)


def passed_over(slot):
    return shipped_splits()[slot.task].passed_over.get(f"{slot.split}/{slot.index}", 0)


@each_task
def test_every_setting_of_every_episode_can_be_expressed(task):
    for split in SPLITS:
        for index in range(0, SIZES[split], 3):
            refused = set(settings_of(get_task(task))) - set(
                expressible(get_episode(task, split, index))
            )
            assert not refused & set(plain_settings())


@each_task
def test_scene_and_words_rule_out_the_seeds_that_were_passed_over(task):
    """So far the oracle has solved what they allow; a seed passed over for its sake is played."""
    for slot in episode_slots([task]):
        assert len(find_seed(slot, check_words).rejections) == passed_over(slot), slot.key


@pytest.mark.sim
@pytest.mark.parametrize("task", ["PickXtimes", "VideoPlaceOrder"])
def test_the_rule_gives_the_shipped_seeds(task):
    """For the last episode for which seeds were passed over, or for a plain one."""
    for slot in sorted(episode_slots([task]), key=lambda one: passed_over(one) > 0)[-1:]:
        assert len(find_seed(slot, check_seed).rejections) == passed_over(slot), slot.key


def test_a_new_setting_does_not_change_which_seeds_are_accepted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    slots = [EpisodeSlot("VideoUnmask", "val", index) for index in (0, 15)]
    before = [find_seed(slot, check_words) for slot in slots]
    mute = dataclasses.replace(
        all_settings()["direct"], name="mute", order=9, refusal=lambda _request: "it is mute"
    )
    every = {**all_settings(), "mute": mute}
    for module in ("settings", "scenarios.spoken"):
        monkeypatch.setattr(f"roboirg.language.{module}.all_settings", lambda: every)

    episode = get_episode("VideoUnmask", "val", 0)

    assert "mute" in settings_of(get_task("VideoUnmask"))
    assert find_refusals(episode) == {"mute": "it is mute"}
    assert [find_seed(slot, check_words) for slot in slots] == before


def test_only_sampled_episodes_need_a_seed():
    assert episode_slots(["VideoUnmask"]) == ()
    assert episode_slots(["VideoPlaceButton"]) == (EpisodeSlot("VideoPlaceButton", "val", 15),)
    assert len(episode_slots(["PutInBox"])) == sum(SIZES[split] for split in SPLITS)
