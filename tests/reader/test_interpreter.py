"""The reader is independent, reads sentences of other people, and accepts any text."""

import ast
import itertools
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from language_variants import first_episodes

from roboirg import reader
from roboirg.core.episode import COLORS, Goal, Point, Scene, SceneObject
from roboirg.language import expressible, instruct
from roboirg.language.settings import plain_settings, settings_of
from roboirg.reader import interpret
from roboirg.reader.places import DirectionalPlace, RelativePlace, read_places
from roboirg.reader.tokens import split_sentences
from roboirg.tasks import every_task, get_task
from roboirg.tasks.splits.splits import get_episode

EPISODES = {task: tuple(first_episodes(task, "train", 8)) for task in every_task()}
PICK = get_episode("PickXtimes", "test", 2).scene
UNMASK = get_episode("VideoUnmask", "test", 0).scene


def test_it_reads_none_of_the_tasks_words():
    trees = [ast.parse(path.read_text()) for path in Path(reader.__file__).parent.glob("*.py")]
    nodes = itertools.chain.from_iterable(map(ast.walk, trees))
    attributes = {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    assert not attributes & {"commands", "wordings", "by_color", "by_place", "patterns"}


WORDS = (
    "the cube there former latter other than one two twice times take lift put it that red blue "
    "green closest to second from left right far near corner container button you not pair , . 3 "
    "of color those more fewer half as many camera never mind 99999999999999999999 ² é "
    "visit placement right before after press first last neighbor whose number is less many into "
    "bin cubes swing stop drop moment moved anything at its during"
)


@settings(max_examples=80)
@given(
    st.sampled_from(tuple(EPISODES)),
    st.one_of(
        st.text(max_size=200),
        st.lists(st.sampled_from(WORDS.split(" ")), max_size=30).map(" ".join),
    ),
)
def test_arbitrary_text_never_raises(task, text):
    scene = EPISODES[task][3].scene
    assert set(interpret(text, scene, task).goals) <= set(get_task(task).goals(scene))


def test_endless_places_are_given_up():
    text = "Take the cube " + "closest to the cube " * 1000 + "at the far left."
    ((place, _),) = read_places(*split_sentences(text))
    depth = 0
    while isinstance(place, RelativePlace):
        place, depth = place.anchor, depth + 1
    assert depth == 4
    assert place == DirectionalPlace("left", 0)
    goals = get_task("PickXtimes").goals(PICK)
    assert len(interpret(text, PICK, "PickXtimes").goals) < len(goals)


@pytest.mark.parametrize("text", ["", "  ", "...", "\n", "?!", "I like the red cube."])
def test_no_command_licenses_no_goal(text):
    for task, (episode, *_) in EPISODES.items():
        found = interpret(text, episode.scene, task)
        assert not found.goals
        assert "finds no command" in found.not_understood


SCENE = Scene(
    (
        SceneObject("button", "button", Point(-0.2, 0.0, 0.0)),
        SceneObject("cube_red", "cube", Point(0.0, 0.1, 0.02), color="red"),
        SceneObject("cube_green", "cube", Point(-0.1, -0.1, 0.02), color="green"),
        SceneObject("cube_blue", "cube", Point(0.05, 0.0, 0.02), color="blue"),
        SceneObject("target", "target", Point(-0.1, 0.12, 0.0), radius=0.04),
    )
)


@pytest.mark.parametrize(
    ("text", "color", "repeats"),
    [
        ("Pick up the red cube and place it on the target 3 times, then press it.", "red", 3),
        ("GRAB   THE RED CUBE , put it on the target TWICE and press the button", "red", 2),
        ("I adore the blue cube. The magic number: 4! Move it to the target that often", "blue", 4),
        ("Red and green are taken. Fetch a cube that is neither of those, once.", "blue", 1),
        ("Red or blue? I did not choose red. Fetch the one of these two that is not red, once.",
         "blue", 1),
        ("Take the cube closest to the left corner far from the robot, put it on the target twice.",
         "red", 2),
        ("Look at the leftmost cube. Take the cube there and put it on the target once.", "red", 1),
        ("Watch the cube nearest to the robot. Put the cube there on the target once.", "green", 1),
        ("My number is two. Take the red cube and drop it on the target two more times than that.",
         "red", 4),
        ("My number is 2. Take the red cube, put it on the target twice as many times as that.",
         "red", 4),
        ("My number is two. Take the red cube and put it on the target one time above that.",
         "red", 3),
        ("Take the cube farthest from the button and put it on the target five times.", "blue", 5),
        ("Take the cube second from the right and put it on the target five times.", "blue", 5),
        ("Take the cube third from the back and put it on the target five times.", "green", 5),
        ("I like green. Ignore the red thing. Pick it up and put it on the disc once.", "green", 1),
    ],
)  # fmt: skip
def test_sentences_of_other_people(text, color, repeats):
    assert interpret(text, SCENE, "PickXtimes").goals == (Goal.of(color=color, repeats=repeats),)


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("Take it and place it on the target that many times.", 15),
        ("Take the cube there and place it on the target four times.", 3),
        ("Take the red cube and place it on the target twice as many times as that.", 2),
        ("Take the red cube and place it on the target one time fewer than that.", 5),
        ("Take the red cube and place it on the target two more times than that.", 3),
    ],
)
def test_what_is_left_open_by_commands_alone(text, count):
    assert len(interpret(text, SCENE, "PickXtimes").goals) == count


def test_picks_tell_how_many_colors_a_goal_has():
    one = interpret("Lift the container that hides it.", UNMASK, "VideoUnmask").goals
    assert {len(goal.texts("colors")) for goal in one} == {1}
    text = "Lift the container over the former, put it down, then lift the one over the latter."
    two = interpret(text, UNMASK, "VideoUnmask").goals
    assert {len(goal.texts("colors")) for goal in two} == {2}
    assert len(two) == 6


TAKE = "Take it and place it on the target that many times."
BLUE = "Blue is nice. My neighbor prefers red, but that does not matter here."


@pytest.mark.parametrize(
    ("text", "slot", "values"),
    [
        (f"{BLUE} {TAKE}", "color", {"blue"}),  # what is waved aside does not count
        (f"I like red. I also like blue. Three! {TAKE}", "color", {"red", "blue"}),
        (f"Five. I like red. My cat has four kittens. {TAKE}", "repeats", {4, 5}),
        ("Look at the cube at the far left. I see the cube closest to you. Take the cube there.",
         "color", {"red", "green"}),
    ],
)  # fmt: skip
def test_rivals_that_are_not_waved_aside_make_a_text_ambiguous(text, slot, values):
    assert {goal[slot] for goal in interpret(text, SCENE, "PickXtimes").goals} == values


def test_what_stays_open_is_named():
    text = f"I like red. I also like blue. Three! My cat has four kittens. {TAKE}"
    found = interpret(text, SCENE, "PickXtimes")
    assert found.not_understood == ("leaves color and repeats open: it can be red or blue",)


@pytest.mark.parametrize("task", every_task())
def test_case_spaces_digits_and_spelling_do_not_matter(task):
    for episode, setting in itertools.product(EPISODES[task][2:4], settings_of(get_task(task))):
        if setting not in expressible(episode):
            assert setting not in plain_settings()
            continue
        text = instruct(episode, setting).text
        digits = text
        for number, word in enumerate(["three", "four", "five", "six"], 3):
            digits = digits.replace(f" {word}", f" {number}")
        for ordinal, word in (("2nd", "second"), ("3rd", "third"), ("4th", "fourth")):
            digits = digits.replace(f" {word}", f" {ordinal}")
        british = text.replace("color", "colour").replace("neighbor", "neighbour")
        short = british.replace("did not", "didn’t").replace("does not", "doesn't")
        for other in (text.upper(), text.replace(" ", "  \t"), digits, british, short, text + "\n"):
            assert interpret(other, episode.scene, task).goals == (episode.goal,), other


def test_an_empty_container_holds_no_goal():
    hard = get_episode("VideoUnmask", "test", 3).scene
    empties = [item for item in hard.of_kind("container") if hard.hidden_in(item.name) is None]
    assert empties
    lone = Scene((empties[0], *hard.of_kind("hidden_cube")))
    found = interpret("Lift the container closest to you.", lone, "VideoUnmask")
    assert not found.goals
    assert found.not_understood
    assert set(COLORS) == {cube.color for cube in hard.of_kind("hidden_cube")}
