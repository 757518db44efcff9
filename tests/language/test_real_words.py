"""Boxes and tapes in words: the generator's, and those of other people."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st
from language_variants import random_episodes

from roboirg.core.episode import ALL_COLORS, Goal, Point, Scene, SceneObject
from roboirg.language import instruct
from roboirg.language.landmarks import MARGIN, landmarks
from roboirg.language.phrases import MentionedValue, anaphor, plain, swap_particles
from roboirg.reader import interpret
from roboirg.reader.places import DirectionalPlace, NamedPlace, read_places
from roboirg.reader.tokens import split_sentences

GREEN = SceneObject("box_green", "box", Point(0.05, 0.15, 0.03), color="green")
PURPLE = SceneObject("box_purple", "box", Point(0.05, -0.15, 0.03), color="purple")
BOXES = Scene((GREEN, PURPLE, SceneObject("tape", "tape", Point(-0.1, 0, 0.0175), 0.0, "yellow")))
YELLOW = SceneObject("tape_yellow", "tape", Point(-0.1, 0.1, 0.0175), color="yellow")
GRAY = SceneObject("tape_gray", "tape", Point(0.0, -0.1, 0.0175), color="gray")
TARGET = SceneObject("target", "target", Point(0.1, 0.0, 0.005), radius=0.05)
TAPES = Scene((YELLOW, GRAY, TARGET))


@pytest.mark.parametrize(
    ("text", "colors"),
    [
        ("Put the tape into the green box.", {"green"}),
        ("Put the yellow tape into the purple box!", {"purple"}),
        ("Pick up the yellow tape and drop it into the green box", {"green"}),
        ("Put the tape in the left box.", {"green"}),
        ("Put the tape inside the box on your right, please.", {"purple"}),
        ("Lay the tape in the rightmost box.", {"purple"}),
        ("I like grey and green. Put it inside the box that is neither.", {"purple"}),
        ("Purple is nice. Never mind the green box. Put the tape into that box.", {"purple"}),
        ("Look at the left box. Put the tape into the box there.", {"green"}),
        ("Put the tape into it.", {"green", "purple"}),
        ("Put the tape into the box there.", {"green", "purple"}),
        ("Put the tape into the box whose color is not in that pair.", {"green", "purple"}),
    ],
)
def test_other_people_name_a_box(text, colors):
    goals = interpret(text, BOXES, "PutInBox").goals
    assert {goal.text("color") for goal in goals} == colors


@pytest.mark.parametrize(
    ("text", "color", "repeats"),
    [
        ("Take the grey tape, put it on the target two times", "gray", 2),
        ("Move the right tape to the target twice.", "gray", 2),
        ("Put the tape on the left on the target once.", "yellow", 1),
        ("I like the yellow tape. 3! Place that tape on the target one time fewer than that.",
         "yellow", 2),
        ("Grab the tape closest to the target and set it down there once.", "gray", 1),
        ("Four. Take the gray tape and place it on the target half as many times as that.",
         "gray", 2),
    ],
)  # fmt: skip
def test_other_people_name_a_tape_and_a_number(text, color, repeats):
    assert interpret(text, TAPES, "PickByCount").goals == (Goal.of(color=color, repeats=repeats),)


GRID = st.integers(-20, 20).map(lambda step: step / 100)


@given(GRID, GRID, GRID, GRID, st.sampled_from(["box", "tape"]))
def test_two_of_a_kind_are_told_by_their_sides_alone(left, right, near, far, kind):
    """The margin along y decides, at any positions along x."""
    one = SceneObject("one", kind, Point(near, left, 0.03), color="green")
    two = SceneObject("two", kind, Point(far, right, 0.03), color="gray")
    scene = Scene((one, two))
    for mine, other in itertools.permutations((one, two)):
        ahead = mine.position.y - other.position.y
        side = "left" if ahead > 0 else "right"
        words = {f"on your {side}"} if abs(ahead) >= MARGIN else set()
        assert {landmark.phrase for landmark in landmarks(scene, kind, mine)} == words


@pytest.mark.parametrize("kind", ["box", "tape"])
def test_for_the_camera_sides_are_mirrored(kind):
    left = SceneObject("left", kind, Point(0.0, 0.15, 0.03), color="green")
    right = SceneObject("right", kind, Point(0.0, -0.15, 0.03), color="gray")
    (landmark,) = landmarks(Scene((left, right)), kind, left, "camera")
    assert landmark.phrase == "on the camera's right"
    assert landmark.sided


def test_sides_of_other_things_are_no_places():
    (words,) = split_sentences("swing it over the target on your right and the box on your left")
    assert read_places(words) == (NamedPlace(DirectionalPlace("left", 0)),)


@pytest.mark.parametrize("task", ["PutInBox", "PickByCount"])
def test_competing_remarks_name_colors_of_the_table_only(task):
    colors = {"PutInBox": {"green", "purple", "yellow"}, "PickByCount": {"yellow", "gray"}}[task]
    for episode in random_episodes(task, 10):
        said = instruct(episode, "contextual", distractor="competing", distractors=40)
        remarks = " ".join(one.text for one in said.utterances if one.stage == "distractor")
        named = set(ALL_COLORS) & set(remarks.replace(",", " ").split())
        assert named == colors - {episode.goal.text("color")}


def test_a_pronoun_stands_between_a_verb_and_its_particle() -> None:
    said = swap_particles(
        (*plain("Pick up "), *anaphor("it", "it", MentionedValue("green", "color")))
    )
    assert "".join(piece.text for piece in said) == "Pick it up"
