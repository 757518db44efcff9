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
def test_two_of_a_kind_are_told_by_their_sides_alone(left, right, near, far, kind):
    """The margin along y decides, at any positions along x."""
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
def test_for_the_camera_sides_are_mirrored(kind):
    left = SceneObject("left", kind, Point(0.0, 0.15, 0.03), color="green")
    right = SceneObject("right", kind, Point(0.0, -0.15, 0.03), color="gray")
    scene = Scene((left, right))
    every = selectors(scene, kind, "camera")

    (landmark,) = [selector.landmark for selector in every if selector.select() is left]

    assert landmark.phrase == "on the camera's right"
    assert landmark.is_sided


@pytest.mark.parametrize("task", ["PutInBox", "PickByCount"])
def test_competing_remarks_name_colors_of_the_table_only(task):
    colors = {"PutInBox": {"green", "purple", "yellow"}, "PickByCount": {"yellow", "gray"}}[task]
    for episode in random_episodes(task, 10):
        said = instruct(episode, "contextual", distractor="competing", distractors=40)
        remarks = " ".join(
            utterance.text for utterance in said.utterances if utterance.stage == "distractor"
        )
        named = set(ALL_COLORS) & set(re.findall("[a-z]+", remarks))
        assert named <= colors - {episode.goal.text("color")}


def test_a_pronoun_stands_between_a_verb_and_its_particle():
    said = swap_particles((*plain("Pick up "), *anaphor("it", "it", "color", "green")))
    assert "".join(piece.text for piece in said) == "Pick it up"
