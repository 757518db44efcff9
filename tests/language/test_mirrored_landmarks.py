"""The mirrored object: what a policy that takes left for right would pick up.

For *the cube on the far left* it is the cube on the far right. `mirrored_objects` returns, for each
object that is right to pick up, the names of the mirrored ones.
"""

from __future__ import annotations

import pytest

from roboirg.language import instruct, mirrored_objects
from roboirg.language.landmarks import FRAMES
from roboirg.language.mirrored_landmarks import exchange_sides
from roboirg.language.places import things_at
from roboirg.tasks import every_task, get_task
from roboirg.tasks.splits.splits import get_episode

each_frame = pytest.mark.parametrize("frame", FRAMES)
each_task_with_places = pytest.mark.parametrize(
    "task", [name for name, task in every_task().items() if task.spatial]
)


@pytest.mark.parametrize(
    ("phrase", "exchanged"),
    [
        ("second from your left", "second from your right"),
        ("nearest to the leftmost, right?", "nearest to the rightmost, left?"),
        ("copyright lefty", "copyright lefty"),
        ("closest to the button", "closest to the button"),
    ],
)
def test_left_and_right_are_exchanged_in_a_phrase_and_other_words_stay(phrase, exchanged):
    """Whole words only: *copyright* contains *right* and is left alone."""
    assert exchange_sides(phrase) == exchanged


def test_the_mirrored_object_of_the_cube_on_the_far_left_is_the_one_on_the_far_right():
    """The blue cube stands on the far left, the red one on the far right, the green one between."""
    episode = get_episode("PickXtimes", "test", 2)
    said = instruct(episode, "spatial")

    assert said.turns[0] == "Let's start with the cube on the far left."
    assert mirrored_objects(episode, said) == {"cube_blue": {"cube_red"}}


def test_a_place_without_left_or_right_has_no_mirrored_object():
    """Who takes left for right still finds the cube that is farthest from the button."""
    episode = get_episode("PickXtimes", "test", 7)
    said = instruct(episode, "spatial")

    assert said.turns[0] == "Let's start with the cube farthest from the button."
    assert mirrored_objects(episode, said) == {}


def test_an_instruction_without_a_place_has_no_mirrored_object():
    """The setting *direct* names no place."""
    episode = get_episode("PickXtimes", "test", 2)
    assert mirrored_objects(episode, instruct(episode, "direct")) == {}


def name_to_handle(item):
    """Return the name of what is picked up for an object: its container, or itself."""
    return item.inside or item.name


def mirrored_places(task, frame):
    """Yield what is said of places that have a mirrored object, in 24 test episodes.

    Each comes with its scene, the phrase that is said, the object that the phrase with left and
    right exchanged means (None if there is none), and the names of the mirrored objects.
    """
    for index in range(24):
        episode = get_episode(task, "test", index)
        said = instruct(episode, "spatial", frame=frame)
        mirrored_names = mirrored_objects(episode, said)
        by_phrase = things_at(episode.scene, get_task(task).things.pointed, frame)
        for place in said.metadata["landmarks"]:
            mirrored = mirrored_names.get(name_to_handle(by_phrase[place]))
            if mirrored:
                yield episode.scene, place, by_phrase.get(exchange_sides(place)), mirrored


@each_frame
@each_task_with_places
def test_the_mirrored_object_is_the_one_selected_by_the_words_with_sides_exchanged(task, frame):
    """If *second from the left* was said, it is what *second from the right* selects."""
    found = list(mirrored_places(task, frame))

    assert found
    for _, place, other, mirrored in found:
        assert exchange_sides(place) != place
        assert name_to_handle(other) in mirrored, place


@each_frame
@each_task_with_places
def test_a_place_has_one_mirrored_object_or_in_binfill_all_cubes_of_its_color(task, frame):
    """BinFill counts cubes, so that the place of one only tells which color to take."""
    for scene, place, other, mirrored in mirrored_places(task, frame):
        if task == "BinFill":
            assert {scene[name].color for name in mirrored} == {other.color}, place
        else:
            assert len(mirrored) == 1, place


@each_frame
@each_task_with_places
def test_a_mirrored_object_is_never_a_right_one(task, frame):
    """Otherwise picking it up would not show that left was taken for right."""
    for index in range(24):
        episode = get_episode(task, "test", index)

        found = mirrored_objects(episode, instruct(episode, "spatial", frame=frame))

        assert found.keys().isdisjoint(frozenset().union(*found.values())), episode.key


@each_frame
@each_task_with_places
def test_the_mirrored_object_is_the_same_in_both_forms_of_an_instruction(task, frame):
    """The form *resolved* names what *implicit* points at; both say the same places."""
    for index in range(24):
        episode = get_episode(task, "test", index)
        implicit = instruct(episode, "spatial", "implicit", frame=frame)
        resolved = instruct(episode, "spatial", "resolved", frame=frame)
        assert mirrored_objects(episode, implicit) == mirrored_objects(episode, resolved)
