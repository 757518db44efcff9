"""Places mean all things that they can mean: those that tie, and those that two measures choose."""

import pytest
from language_variants import containers

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
    """`places` are those of container_0, container_1 and container_2, as (x, y) in meters.

    x grows away from the robot, y to its left. By each of the phrases container_0 and container_1
    are nearly equal (they differ by 1 cm or less), or one way to measure (depth or side alone,
    distance from the robot) chooses the one and another way the other; container_2 is never meant.
    """
    found = names_meant(containers(*places), "container", words)
    assert found == ["container_0", "container_1"]


@pytest.mark.parametrize(
    ("second", "names"),
    [((0.005, 0.15), ["container_0", "container_1"]), ((-0.05, 0.15), ["container_1"])],
    ids=["unclear", "clear"],
)
def test_a_place_within_a_group_is_unclear_if_the_group_is(second, names):
    """container_2 stands closest to the robot, and container_1, at `second`, farther left than
    container_0.

    So is container_1 one of *the two closest to you*? Yes if it is 5 cm closer than container_0 (x
    is the distance along the table, in meters); unclear, so that both may be meant, if it is
    hardly farther away (5 mm).
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
    """container_0 stands 20 cm to the robot's left (y = 0.2), and container_1 as far to its right.

    The camera looks at the robot from the front, so that its picture shows container_1 on the
    left.
    """
    scene = containers((0.0, 0.2), (0.0, -0.2))
    assert names_meant(scene, "container", words) == [name]


@pytest.mark.parametrize("index", [3, 14])
@pytest.mark.parametrize("task", [name for name, task in every_task().items() if task.spatial])
def test_the_interpreter_finds_the_object_of_each_of_our_phrases_for_a_place(task, index):
    """The benchmark writes phrases such as *farthest to your left* (`selectors`), each with the
    object of the scene that it singles out, or None where none is ahead by a clear margin; then it
    is not used.

    The interpreter shares no code with these phrases, so it checks them: their object must be among
    those that it finds for *Take the NOUN PHRASE.* The scenes are test episodes 3 and 14. In a
    command a thing of the kind `hidden_cube`, a cube under a cover, is called *cube* too.
    """
    kind = get_task(task).things.pointed
    noun = kind.removeprefix("hidden_")
    scene = get_episode(task, "test", index).scene
    phrases = [*selectors(scene, kind, "robot"), *selectors(scene, kind, "camera")]

    used = [phrase for phrase in phrases if phrase.select() is not None]

    assert used
    for phrase in used:
        assert phrase.select().name in names_meant(scene, noun, phrase.phrase), phrase.phrase
