"""The interface: names, options, errors, sameness."""

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


def test_every_task_offers_the_four_settings_of_the_paper_and_some_tasks_spatial():
    """A setting is a way of speaking, such as *direct*; two harder ones are our own."""
    four = ["explicit", "direct", "reasoning", "contextual"]
    assert [*plain_settings()] == [*four, "spatial"]

    # Each harder setting and the usual one that it is made from.
    harder = {
        setting.name: setting.plain
        for setting in all_settings().values()
        if setting.plain is not None
    }
    assert harder == {"direct-rival": "direct", "grounded": "direct"}

    expected = {
        (name, setting)
        for name in every_task()
        for setting in (four if name in TASKS_WITHOUT_SPATIAL_SETTING else [*four, "spatial"])
    }
    assert set(PAIRS) == expected
    for name, setting in PAIRS:
        assert instruct(get_episode(name, "test", 0), setting).setting == setting


@pytest.mark.parametrize(
    ("arguments", "options", "nearest"),
    [
        (("directt",), {}, "direct"),
        (("direct", "resolve"), {}, "resolved"),
        (("contextual",), {"distractor": "neutrl"}, "neutral"),
        (("spatial",), {"frame": "robt"}, "robot"),
    ],
)
def test_a_misspelled_option_is_refused_with_the_nearest_valid_name(arguments, options, nearest):
    with pytest.raises(UnknownNameError, match=f"Did you mean '{nearest}'"):
        instruct(EPISODE, *arguments, **options)


@pytest.mark.parametrize(
    "options",
    [{"stages": (1, 3, 5)}, {"stages": ()}, {"stages": (5, 1)}, {"distractors": 0},
     {"distractors": True}],
)  # fmt: skip
def test_impossible_stages_and_numbers_of_distractors_are_refused(options):
    """The stages of a dialogue are 1 to 5, each at most once and in order; a distractor is a
    remark."""
    with pytest.raises(InvalidValueError):
        instruct(EPISODE, "contextual", **options)


def test_the_explicit_setting_has_the_same_text_in_both_forms():
    """The form *resolved* states what the *implicit* one only points at; explicit leaves nothing
    out."""
    implicit = instruct(EPISODE)
    resolved = instruct(EPISODE, "explicit", "resolved")
    assert (implicit.text, implicit.form, resolved.form) == (resolved.text, "implicit", "resolved")


def test_a_dialogue_has_as_many_distracting_remarks_as_requested():
    """No remark follows itself, though 64 are more than there are different ones."""
    for distractor in ("neutral", "competing"):
        said = instruct(EPISODE, "contextual", distractors=64, distractor=distractor)
        remarks = [
            utterance.text for utterance in said.utterances if utterance.stage == "distractor"
        ]
        assert len(remarks) == 64
        assert all(remark != two for remark, two in itertools.pairwise(remarks))


def test_the_spatial_setting_refuses_a_scene_whose_cubes_no_place_can_tell_apart():
    """The cubes of this scene stand almost at the same point."""
    lacking = without_landmark(EPISODE)
    assert "spatial" not in expressible(lacking)
    with pytest.raises(InvalidValueError, match="no landmark"):
        instruct(lacking, "spatial")


def test_another_python_process_produces_the_same_instruction():
    """Finds words that depend on hash seeds or on what was generated before."""
    program = (
        "from roboirg.tasks.splits import get_episode; from roboirg.language import instruct;"
        "print(instruct(get_episode('PickXtimes', 'test', 2), 'contextual').text, end='')"
    )
    command = [sys.executable, "-c", program]

    other = subprocess.run(command, capture_output=True, text=True, check=True)

    assert other.stdout == instruct(EPISODE, "contextual").text
