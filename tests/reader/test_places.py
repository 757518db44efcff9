"""Places mean all things that they can mean: those that tie, and those that two measures choose."""

import pytest

from roboirg.core.episode import Point, Scene, SceneObject
from roboirg.language.landmarks import selectors
from roboirg.reader.command import parse_sentence
from roboirg.reader.referents import Referents
from roboirg.reader.tokens import split_sentences
from roboirg.tasks import every_task, get_task
from roboirg.tasks.splits import get_episode


def names_meant(scene, noun, words):
    """Return the names of the things that a phrase can mean in *Take the NOUN PHRASE.*, sorted."""
    (sentence,) = split_sentences(f"Take the {noun} {words}.")
    reading = parse_sentence(sentence)
    assert not reading.unread, words
    (clause,) = reading.clauses
    (thing,) = clause.values("thing")
    return sorted(item.name for item in Referents(scene).things_at(thing, thing.place))


def containers(*places):
    """Return a scene with container_0, container_1 … at points (x, y) in meters.

    The robot is at smaller x and looks along x; its left is positive y.
    """
    objects = []
    for number, (x, y) in enumerate(places):
        objects.append(SceneObject(f"container_{number}", "container", Point(x, y, 0.05)))
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
    """container_0 and container_1 tie, or one measure chooses the one and another the other."""
    found = names_meant(containers(*places), "container", words)
    assert found == ["container_0", "container_1"]


@pytest.mark.parametrize(
    ("second", "names"),
    [((0.005, 0.15), ["container_0", "container_1"]), ((-0.05, 0.15), ["container_1"])],
    ids=["unclear", "clear"],
)
def test_a_place_within_a_group_is_unclear_if_the_group_is(second, names):
    """container_1 is the leftmost one, but is it one of *the two closest to you*?

    It is clear if it is 5 cm closer than container_0, and unclear if they are equally close.
    """
    scene = containers((0.0, 0.1), second, (-0.1, 0.0))
    phrase = "farthest to your left among the two closest to you"
    assert names_meant(scene, "container", phrase) == names


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("on the left", "container_0"),
        ("on the left of the picture", "container_1"),
        ("on the camera's right", "container_0"),
    ],
)
def test_left_and_right_of_the_picture_are_mirrored(words, name):
    """container_0 stands on the robot's left; the camera looks at the robot from the front."""
    scene = containers((0.0, 0.2), (0.0, -0.2))
    assert names_meant(scene, "container", words) == [name]


@pytest.mark.parametrize("index", [3, 14])
@pytest.mark.parametrize("task", [name for name, task in every_task().items() if task.spatial])
def test_the_interpreter_finds_the_object_of_each_of_our_phrases_for_a_place(task, index):
    """It is written without our phrases, so this checks both."""
    kind = get_task(task).things.pointed
    noun = kind.removeprefix("hidden_")
    scene = get_episode(task, "test", index).scene
    for selector in [*selectors(scene, kind, "robot"), *selectors(scene, kind, "camera")]:
        thing = selector.select()
        phrase = selector.phrase
        if thing is not None:
            assert thing.name in names_meant(scene, noun, phrase), phrase
