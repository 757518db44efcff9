"""Objects that an instruction's places mean with left and right exchanged."""

from __future__ import annotations

import pytest

from roboirg.core.episode import Episode, SceneObject
from roboirg.language import instruct, mirrored_objects
from roboirg.language.landmarks import FRAMES
from roboirg.language.mirrored_landmarks import exchange_sides
from roboirg.language.places import things_at
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode

TASKS_WITH_SIDES = tuple(name for name, task in every_task().items() if task.spatial)


def test_left_and_right_are_exchanged_in_a_phrase_and_other_words_stay():
    """Whole words only: *copyright* contains *right* and is left alone."""
    assert exchange_sides("second from your left") == "second from your right"
    assert exchange_sides("nearest to the leftmost, right?") == "nearest to the rightmost, left?"
    assert exchange_sides("copyright lefty") == "copyright lefty"
    assert exchange_sides("closest to the button") == "closest to the button"


def object_to_handle(item: SceneObject) -> str:
    """The name of what to handle for an object: its container, or itself."""
    return item.inside or item.name


def places_said(episode: Episode, frame: str) -> list[str]:
    metadata = instruct(episode, "spatial", frame=frame).metadata
    places = metadata["landmarks"]
    assert isinstance(places, list)
    return places


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("task", TASKS_WITH_SIDES)
def test_the_mirrored_object_is_the_one_selected_by_the_words_with_sides_exchanged(task, frame):
    """The mirrored object is what a policy that takes left for right would pick up."""
    mirrored_places = 0
    for index in range(24):
        episode = get_episode(task, "test", index)
        scene = episode.scene
        selected = things_at(scene, every_task()[task].things.pointed, frame)

        found = mirrored_objects(episode, instruct(episode, "spatial", frame=frame))

        for place in places_said(episode, frame):
            target = selected[place]
            other = selected.get(exchange_sides(place))
            assert target is not None
            mirrored = found.get(object_to_handle(target))
            if not mirrored:
                continue
            mirrored_places += 1
            assert exchange_sides(place) != place
            assert other is not None
            assert other is not target
            assert object_to_handle(other) in mirrored
            # Where the goal counts cubes, a place tells their color only.
            assert len(mirrored) == 1 or task == "BinFill"
            colors = {scene[name].color for name in mirrored if scene[name].kind == "cube"}
            assert colors <= {other.color}
            assert colors or mirrored == {object_to_handle(other)}
    assert mirrored_places > 0


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("task", TASKS_WITH_SIDES)
def test_the_mirrored_object_is_never_a_right_one_and_is_equal_in_both_forms(task, frame):
    """The form *resolved* states what the other one points at; both have the same places."""
    for index in range(24):
        episode = get_episode(task, "test", index)

        found = mirrored_objects(episode, instruct(episode, "spatial", frame=frame))

        resolved = instruct(episode, "spatial", "resolved", frame=frame)
        assert mirrored_objects(episode, resolved) == found
        assert not mirrored_objects(episode, instruct(episode, "direct"))
        assert not found.keys() & frozenset().union(*found.values())  # what is meant is not
