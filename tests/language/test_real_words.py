"""Words for boxes and rolls of tape, the things of the study with a real robot."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from language_variants import random_episodes

from roboirg.core.episode import ALL_COLORS, Point, Scene, SceneObject
from roboirg.language import instruct
from roboirg.language.landmarks import selectors
from roboirg.language.phrases import anaphor, plain, swap_particles

coordinates = st.integers(-20, 20).map(lambda centimeters: centimeters / 100)


def phrases_of_two(kind, green_at, gray_at, frame="robot"):
    """Return the phrases for a green and a gray thing, by color; places are (x, y) in meters."""
    green = SceneObject("green", kind, Point(*green_at, 0.03), color="green")
    gray = SceneObject("gray", kind, Point(*gray_at, 0.03), color="gray")
    found = {"green": [], "gray": []}
    for selector in selectors(Scene((green, gray)), kind, frame):
        thing = selector.select()
        if thing is not None:
            found[thing.name].append(selector.phrase)
    return found


@pytest.mark.parametrize("kind", ["box", "tape"])
def test_the_object_on_the_robot_s_left_is_on_the_camera_s_right(kind):
    """The camera looks at the robot from the front."""
    found = phrases_of_two(kind, (0.0, 0.15), (0.0, -0.15), frame="camera")
    assert found == {"green": ["on the camera's right"], "gray": ["on the camera's left"]}


@given(
    kind=st.sampled_from(["box", "tape"]),
    left=coordinates,
    right=coordinates,
    near=coordinates,
    far=coordinates,
)
def test_two_boxes_or_tapes_are_told_apart_by_left_and_right_if_these_are_clear(
    kind, left, right, near, far
):
    """They are clear from a difference of 3 cm in y on, however far away the two stand along x."""
    found = phrases_of_two(kind, (near, left), (far, right))

    if left - right >= 0.03:
        assert found == {"green": ["on your left"], "gray": ["on your right"]}
    elif right - left >= 0.03:
        assert found == {"green": ["on your right"], "gray": ["on your left"]}
    else:
        assert found == {"green": [], "gray": []}


@pytest.mark.parametrize(
    ("task", "colors"),
    [("PutInBox", {"green", "purple", "yellow"}), ("PickByCount", {"yellow", "gray"})],
)
def test_remarks_about_another_color_name_colors_of_the_scene_other_than_the_goal_s(task, colors):
    """A competing remark is about what is not wanted: *better than the yellow one I have at home*.

    `colors` are those of the things in the scenes of the task.
    """
    for episode in random_episodes(task, 10):
        said = instruct(episode, "contextual", distractor="competing", distractors=40)
        for utterance in said.utterances:
            if utterance.stage == "distractor":
                named = set(ALL_COLORS) & set(re.findall("[a-z]+", utterance.text))
                assert named <= colors - {episode.goal.text("color")}, utterance.text


def test_pick_up_it_becomes_pick_it_up():
    """A pronoun stands between a verb and its particle."""
    said = swap_particles((*plain("Pick up "), *anaphor("it", "it", "color", "green")))
    assert "".join(piece.text for piece in said) == "Pick it up"
