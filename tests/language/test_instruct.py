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


WITHOUT_SPATIAL = ("StopCube", "VideoRepick", "VideoPlaceButton", "VideoPlaceOrder")


def test_every_task_has_the_settings_of_the_paper():
    four = ["explicit", "direct", "reasoning", "contextual"]
    assert [*plain_settings()] == [*four, "spatial"]

    harder = {
        setting.name: setting.plain
        for setting in all_settings().values()
        if setting.plain is not None
    }
    assert harder == {"direct-rival": "direct", "grounded": "direct"}

    expected = {
        (name, setting)
        for name in every_task()
        for setting in (four if name in WITHOUT_SPATIAL else [*four, "spatial"])
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
def test_unknown_names_are_refused_with_the_nearest(arguments, options, nearest):
    with pytest.raises(UnknownNameError, match=f"Did you mean '{nearest}'"):
        instruct(EPISODE, *arguments, **options)


@pytest.mark.parametrize(
    "options",
    [{"stages": (1, 3, 5)}, {"stages": ()}, {"stages": (5, 1)}, {"distractors": 0},
     {"distractors": True}],
)  # fmt: skip
def test_invalid_options_are_refused(options):
    with pytest.raises(InvalidValueError):
        instruct(EPISODE, "contextual", **options)


def test_explicit_is_its_own_resolved_form():
    implicit = instruct(EPISODE)
    resolved = instruct(EPISODE, "explicit", "resolved")
    assert (implicit.text, implicit.form, resolved.form) == (resolved.text, "implicit", "resolved")


def test_distractors_are_as_many_as_asked_for():
    for distractor in ("neutral", "competing"):
        said = instruct(EPISODE, "contextual", distractors=64, distractor=distractor)
        remarks = [
            utterance.text for utterance in said.utterances if utterance.stage == "distractor"
        ]
        assert len(remarks) == 64
        assert all(remark != two for remark, two in itertools.pairwise(remarks))


def test_an_episode_without_landmark_is_refused_in_the_spatial_setting():
    lacking = without_landmark(EPISODE)
    assert "spatial" not in expressible(lacking)
    with pytest.raises(InvalidValueError, match="no landmark"):
        instruct(lacking, "spatial")


def test_the_same_words_in_another_process():
    program = (
        "from roboirg.tasks.splits import get_episode; from roboirg.language import instruct;"
        "print(instruct(get_episode('PickXtimes', 'test', 2), 'contextual').text, end='')"
    )
    command = [sys.executable, "-c", program]

    other = subprocess.run(command, capture_output=True, text=True, check=True)

    assert other.stdout == instruct(EPISODE, "contextual").text
