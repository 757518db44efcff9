"""The functions that give an episode its words: settings, options, errors, same words always."""

import itertools
import subprocess
import sys

import pytest
from language_variants import PAIRS, without_landmark

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.language import expressible, instruct, plain_settings
from roboirg.language.settings import all_settings
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode

EPISODE = get_episode("PickXtimes", "test", 2)
TASKS_WITHOUT_SPATIAL_SETTING = ("StopCube", "VideoRepick", "VideoPlaceButton", "VideoPlaceOrder")


def test_the_usual_settings_are_the_four_of_the_paper_and_spatial():
    """A setting is a way to leave values of the goal unsaid: *direct* says *it* for the cube."""
    assert [*plain_settings()] == ["explicit", "direct", "reasoning", "contextual", "spatial"]


@pytest.mark.parametrize("task", every_task())
def test_every_task_offers_the_four_settings_of_the_paper_and_some_tasks_spatial(task):
    """Four tasks have no place to name: what they handle is not chosen by where it stands."""
    expected = {"explicit", "direct", "reasoning", "contextual"}
    if task not in TASKS_WITHOUT_SPATIAL_SETTING:
        expected.add("spatial")
    assert {setting for name, setting in PAIRS if name == task} == expected


def test_two_harder_settings_are_made_from_the_setting_direct():
    """`plain` names the setting that is compared with the harder one."""
    harder = {
        setting.name: setting.plain
        for setting in all_settings().values()
        if setting.plain is not None
    }
    assert harder == {"direct-rival": "direct", "grounded": "direct"}


@pytest.mark.parametrize("task", ["PickXtimes", "StopCube"])
@pytest.mark.parametrize("setting", ["explicit", "direct", "reasoning", "contextual"])
def test_the_instruction_of_a_task_has_the_setting_that_was_asked_for(task, setting):
    said = instruct(get_episode(task, "test", 0), setting)

    assert said.setting == setting


@pytest.mark.parametrize(
    ("arguments", "options", "nearest"),
    [
        (("directt",), {}, "direct"),
        (("direct", "resolve"), {}, "resolved"),
        (("contextual",), {"distractor": "neutrl"}, "neutral"),
        (("spatial",), {"frame": "robt"}, "robot"),
    ],
    ids=["setting", "form", "kind of distractor", "frame of reference"],
)
def test_a_misspelled_option_is_refused_with_the_nearest_valid_name(arguments, options, nearest):
    """`instruct(episode, "directt")` asks: *Did you mean 'direct'?*"""
    with pytest.raises(UnknownNameError, match=f"Did you mean '{nearest}'"):
        instruct(EPISODE, *arguments, **options)


@pytest.mark.parametrize("stages", [(1, 3, 5), (), (5, 1)])
def test_stages_of_a_dialogue_that_do_not_make_one_are_refused(stages):
    """A dialogue has 1 introduction, 2 reinforcement, 3 distractor, 4 cue, 5 command.

    A distractor needs a reinforcement before it, and stages are in order.
    """
    with pytest.raises(InvalidValueError, match="stages"):
        instruct(EPISODE, "contextual", stages=stages)


@pytest.mark.parametrize("number", [0, True])
def test_a_number_of_distractors_must_be_a_whole_number_from_1(number):
    """Python takes True for the number 1; as an option it is a mistake."""
    with pytest.raises(InvalidValueError, match="distractors"):
        instruct(EPISODE, "contextual", distractors=number)


def test_the_explicit_setting_has_the_same_text_in_both_forms():
    """The form *implicit* points at values, and *resolved* names them; explicit points at none."""
    implicit = instruct(EPISODE, "explicit", "implicit")
    resolved = instruct(EPISODE, "explicit", "resolved")

    assert implicit.text == resolved.text
    assert (implicit.form, resolved.form) == ("implicit", "resolved")


@pytest.mark.parametrize("kind", ["neutral", "competing"])
def test_a_dialogue_has_as_many_distracting_remarks_as_requested(kind):
    """A distractor is a remark that is not needed, such as *Her bus was late*.

    There are fewer than 64 different ones, but none is said twice in a row.
    """
    said = instruct(EPISODE, "contextual", distractors=64, distractor=kind)

    remarks = [utterance.text for utterance in said.utterances if utterance.stage == "distractor"]
    assert len(remarks) == 64
    for remark, following in itertools.pairwise(remarks):
        assert remark != following


def test_the_spatial_setting_refuses_a_scene_whose_cubes_no_place_can_tell_apart():
    """All cubes of this scene stand within 3 mm, so that none is *the one on the left*."""
    crowded = without_landmark(EPISODE)

    assert "spatial" not in expressible(crowded)
    with pytest.raises(InvalidValueError, match="no landmark"):
        instruct(crowded, "spatial")


def test_another_python_process_produces_the_same_instruction():
    """Would find words that depend on hash seeds or on what was said before."""
    program = (
        "from roboirg.tasks.splits import get_episode; from roboirg.language import instruct;"
        "print(instruct(get_episode('PickXtimes', 'test', 2), 'contextual').text, end='')"
    )

    other = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )

    assert other.stdout == instruct(EPISODE, "contextual").text
