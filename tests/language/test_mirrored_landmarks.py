"""The mirrored object: what a policy that takes left for right would pick up.

For *the cube on the far left* it is the cube on the far right. `mirrored_objects` returns, for each
object that is right to pick up, the names of the mirrored ones.
"""

from __future__ import annotations

from typing import NamedTuple

import pytest

from roboirg.core.episode import Scene, SceneObject
from roboirg.language import instruct, mirrored_objects
from roboirg.language.landmarks import FRAMES
from roboirg.language.mirrored_landmarks import exchange_sides
from roboirg.language.places import things_at
from roboirg.tasks import every_task, get_task
from roboirg.tasks.splits.splits import get_episode

each_frame = pytest.mark.parametrize("frame", FRAMES)
PLACED_TASKS = [name for name, task in every_task().items() if task.spatial]
each_task_with_places = pytest.mark.parametrize("task", PLACED_TASKS)


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


@pytest.mark.parametrize(
    ("index", "introduction", "mirrored"),
    [
        (2, "Let's start with the cube on the far left.", {"cube_blue": {"cube_red"}}),
        (7, "Let's start with the cube farthest from the button.", {}),
    ],
)
def test_a_place_on_one_side_has_a_mirrored_object_and_another_place_has_none(
    index, introduction, mirrored
):
    """In episode 2 the blue cube stands on the far left, the red one on the far right, and the
    green one between. In episode 7, who takes left for right still finds the cube that is farthest
    from the button."""
    episode = get_episode("PickXtimes", "test", index)
    said = instruct(episode, "spatial")

    assert said.turns[0] == introduction
    assert mirrored_objects(episode, said) == mirrored


def test_an_instruction_without_a_place_has_no_mirrored_object():
    """The setting *direct* names no place."""
    episode = get_episode("PickXtimes", "test", 2)
    assert mirrored_objects(episode, instruct(episode, "direct")) == {}


class MirroredPlace(NamedTuple):
    """Words of a place that were said in a scene, such as *second from the left*.

    Attributes:
        words: these.
        exchanged: the object of *second from the right*, the words with sides exchanged.
        mirrored: names of what `mirrored_objects` returns for the object of the words.
        scene: the scene.
    """

    words: str
    exchanged: SceneObject
    mirrored: frozenset[str]
    scene: Scene


def mirrored_places(task, frame):
    """Return the places with a mirrored object that are said in 24 test episodes."""
    found = []
    for index in range(24):
        episode = get_episode(task, "test", index)
        said = instruct(episode, "spatial", frame=frame)
        mirrored_names = mirrored_objects(episode, said)
        by_phrase = things_at(episode.scene, get_task(task).things.pointed, frame)
        for words in said.metadata["landmarks"]:
            right = by_phrase[words]
            mirrored = mirrored_names.get(right.inside or right.name)
            if mirrored:
                exchanged = by_phrase[exchange_sides(words)]
                found.append(MirroredPlace(words, exchanged, mirrored, episode.scene))
    assert found
    return found


@each_frame
@each_task_with_places
def test_the_mirrored_object_is_the_one_selected_by_the_words_with_sides_exchanged(task, frame):
    """`mirrored_places` has the places that are said in 24 episodes. If *second from the left* was
    said, the mirrored object is the one that *second from the right* selects in the scene: what is
    picked up for a cube in a container is the container."""
    for place in mirrored_places(task, frame):
        picked_up = place.exchanged.inside or place.exchanged.name

        assert picked_up in place.mirrored, place.words


@each_frame
@pytest.mark.parametrize("task", [task for task in PLACED_TASKS if task != "BinFill"])
def test_a_place_has_one_mirrored_object(task, frame):
    """`mirrored_places` has the places that are said in 24 episodes. There is one object *second
    from the right*, and who takes left for right picks up this one."""
    for place in mirrored_places(task, frame):
        assert len(place.mirrored) == 1, place.words


@each_frame
def test_in_binfill_the_mirrored_objects_are_cubes_of_the_color_on_the_other_side(frame):
    """BinFill counts cubes of a color, and the place of one cube only tells the color: who takes
    left for right picks up cubes of the color of the cube on the other side."""
    for place in mirrored_places("BinFill", frame):
        colors = {place.scene[name].color for name in place.mirrored}

        assert colors == {place.exchanged.color}, place.words


@each_frame
@each_task_with_places
def test_a_mirrored_object_is_never_a_right_one(task, frame):
    """`mirrored_objects` maps each object that is right to pick up to those that would be right
    with left and right exchanged. In 24 episodes none may be both: picking it up would not show
    that left was taken for right."""
    for index in range(24):
        episode = get_episode(task, "test", index)

        found = mirrored_objects(episode, instruct(episode, "spatial", frame=frame))

        assert found.keys().isdisjoint(frozenset().union(*found.values())), episode.key


@each_frame
@each_task_with_places
def test_the_mirrored_object_is_the_same_in_both_forms_of_an_instruction(task, frame):
    """`mirrored_objects` maps each object that is right to pick up to those that would be right
    with left and right exchanged. The form *resolved* names what *implicit* points at; both say the
    same places, so the result is the same."""
    for index in range(24):
        episode = get_episode(task, "test", index)
        implicit = instruct(episode, "spatial", "implicit", frame=frame)
        resolved = instruct(episode, "spatial", "resolved", frame=frame)
        assert mirrored_objects(episode, implicit) == mirrored_objects(episode, resolved)
