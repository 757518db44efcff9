"""Places mean all things that they can mean: those that tie, and those that two measures choose."""

import pytest

from roboirg.core.episode import Point, Scene, SceneObject
from roboirg.language.landmarks import FRAMES, selectors
from roboirg.reader.command import parse_sentence
from roboirg.reader.referents import Referents
from roboirg.reader.tokens import split_sentences
from roboirg.tasks import every_task, get_task
from roboirg.tasks.splits import get_episode


def things_meant_by(scene, noun, words):
    """Return the names of the things that words can mean."""
    (sentence,) = split_sentences(f"Take the {noun} {words}.")
    (clause,) = parse_sentence(sentence).clauses
    (thing,) = clause.values("thing")
    assert not parse_sentence(sentence).unread, words
    return sorted(item.name for item in Referents(scene).things_at(thing, thing.place))


def containers(places):
    objects = [
        SceneObject(f"container_{number}", "container", Point(x, y, 0.05))
        for number, (x, y) in enumerate(places)
    ]
    return Scene(tuple(objects))


@pytest.mark.parametrize(
    ("words", "places"),
    [
        ("farthest to your left", [(0.1, 0.1), (-0.1, 0.105), (0.0, 0.0)]),
        ("on the left", [(0.1, 0.2), (-0.1, 0.1), (0.0, -0.1)]),
        ("closest to you", [(-0.1, 0.1), (-0.105, -0.1), (0.0, 0.0)]),
        ("all the way in the back", [(0.1, 0.0), (0.09, 0.2), (0.0, 0.0)]),
        ("second from your left", [(0.1, 0.1), (-0.1, 0.105), (0.0, 0.0)]),
        ("in the near left corner", [(-0.1, 0.1), (-0.098, 0.1), (0.0, 0.0)]),
        ("nearest to the container farthest to your left", [(0.1, 0.0), (-0.1, 0.0), (0.0, 0.1)]),
    ],
)
def test_of_two_things_at_nearly_the_same_place_both_may_be_meant(words, places):
    """`places` are points (x, y) of three containers; the robot's left is positive y."""
    assert things_meant_by(containers(places), "container", words) == ["container_0", "container_1"]


def test_a_place_within_a_group_is_unclear_if_the_group_is():
    """First, any two of the three could be *the two closest to you*; then it is clear which."""
    places = [(0.0, 0.1), (0.005, 0.15), (-0.1, 0.0)]
    words = "farthest to your left among the two closest to you"
    assert things_meant_by(containers(places), "container", words) == [
        "container_0",
        "container_1",
    ]

    places[1] = (-0.05, 0.15)
    assert things_meant_by(containers(places), "container", words) == ["container_1"]


def test_left_and_right_of_the_picture_are_mirrored():
    """The camera looks at the robot from the front."""
    scene = containers([(0.0, 0.2), (0.0, -0.2)])
    assert things_meant_by(scene, "container", "on the left") == ["container_0"]
    assert things_meant_by(scene, "container", "on the left of the picture") == ["container_1"]
    assert things_meant_by(scene, "container", "on the camera's right") == ["container_0"]


@pytest.mark.parametrize("task", [name for name, task in every_task().items() if task.spatial])
def test_the_interpreter_finds_the_object_of_each_of_our_phrases_for_a_place(task):
    kind = get_task(task).things.pointed
    for index in (3, 14):
        scene = get_episode(task, "test", index).scene
        for frame in FRAMES:
            for selector in selectors(scene, kind, frame):
                selected = selector.select()
                words = selector.landmark.phrase
                if selected is not None:
                    names = things_meant_by(scene, kind.removeprefix("hidden_"), words)
                    assert selected.name in names, words
