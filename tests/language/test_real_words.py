"""Boxes and tapes in words: the generator's, and those of other people."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from language_variants import random_episodes

from roboirg.core.episode import ALL_COLORS, Point, Scene, SceneObject
from roboirg.language import instruct
from roboirg.language.landmarks import MARGIN, selectors
from roboirg.language.phrases import anaphor, plain, swap_particles

GRID = st.integers(-20, 20).map(lambda step: step / 100)


@given(GRID, GRID, GRID, GRID, st.sampled_from(["box", "tape"]))
def test_two_boxes_or_tapes_are_told_apart_by_left_and_right_if_these_are_clear(
    left, right, near, far, kind
):
    """They are clear if the positions along y differ by the margin, wherever they stand along x."""
    green = SceneObject("green", kind, Point(near, left, 0.03), color="green")
    gray = SceneObject("gray", kind, Point(far, right, 0.03), color="gray")
    scene = Scene((green, gray))

    found = {"green": set(), "gray": set()}
    for selector in selectors(scene, kind, "robot"):
        thing = selector.select()
        if thing is not None:
            found[thing.name].add(selector.landmark.phrase)

    expected = {"green": set(), "gray": set()}
    if abs(left - right) >= MARGIN:
        leftmost, rightmost = ("green", "gray") if left > right else ("gray", "green")
        expected = {leftmost: {"on your left"}, rightmost: {"on your right"}}
    assert found == expected


@pytest.mark.parametrize("kind", ["box", "tape"])
def test_the_object_on_the_robot_s_left_is_on_the_camera_s_right(kind):
    """The camera looks at the robot from the front."""
    left = SceneObject("left", kind, Point(0.0, 0.15, 0.03), color="green")
    right = SceneObject("right", kind, Point(0.0, -0.15, 0.03), color="gray")
    scene = Scene((left, right))
    every = selectors(scene, kind, "camera")

    (landmark,) = [selector.landmark for selector in every if selector.select() is left]

    assert landmark.phrase == "on the camera's right"
    assert landmark.is_sided


@pytest.mark.parametrize("task", ["PutInBox", "PickByCount"])
def test_remarks_about_another_color_name_colors_of_the_scene_other_than_the_goal_s(task):
    """Competing remarks are distractions about a color that is not wanted."""
    colors = {"PutInBox": {"green", "purple", "yellow"}, "PickByCount": {"yellow", "gray"}}[task]
    for episode in random_episodes(task, 10):
        said = instruct(episode, "contextual", distractor="competing", distractors=40)
        remarks = " ".join(
            utterance.text for utterance in said.utterances if utterance.stage == "distractor"
        )
        named = set(ALL_COLORS) & set(re.findall("[a-z]+", remarks))
        assert named <= colors - {episode.goal.text("color")}


def test_pick_up_it_becomes_pick_it_up():
    said = swap_particles((*plain("Pick up "), *anaphor("it", "it", "color", "green")))
    assert "".join(piece.text for piece in said) == "Pick it up"
