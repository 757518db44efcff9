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

SPATIAL = tuple(name for name, task in every_task().items() if task.spatial)


def test_sides_are_exchanged_as_words():
    assert exchange_sides("second from your left") == "second from your right"
    assert exchange_sides("nearest to the leftmost, right?") == "nearest to the rightmost, left?"
    assert exchange_sides("copyright lefty") == "copyright lefty"
    assert exchange_sides("closest to the button") == "closest to the button"


def handled(item: SceneObject) -> str:
    """The name of what to handle for an object: its container, or itself."""
    return item.inside or item.name


def chosen(episode: Episode, frame: str) -> list[str]:
    metadata = instruct(episode, "spatial", frame=frame).metadata
    places = metadata["landmarks"]
    assert isinstance(places, list)
    return places


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("task", SPATIAL)
def test_the_mirrored_object_is_what_the_exchanged_words_select(task, frame):
    mirrored_places = 0
    for index in range(24):
        episode = get_episode(task, "test", index)
        scene = episode.scene
        selected = things_at(scene, every_task()[task].things.pointed, frame)

        found = mirrored_objects(episode, instruct(episode, "spatial", frame=frame))

        for place in chosen(episode, frame):
            target = selected[place]
            other = selected.get(exchange_sides(place))
            assert target is not None
            mirrored = found.get(handled(target))
            if not mirrored:
                continue
            mirrored_places += 1
            assert exchange_sides(place) != place
            assert other is not None
            assert other is not target
            assert handled(other) in mirrored
            # Where the goal counts cubes, a place tells their color only.
            assert len(mirrored) == 1 or task == "BinFill"
            colors = {scene[name].color for name in mirrored if scene[name].kind == "cube"}
            assert colors <= {other.color}
            assert colors or mirrored == {handled(other)}
    assert mirrored_places > 0


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("task", SPATIAL)
def test_what_is_mirrored_is_no_target_and_the_same_in_both_forms(task, frame):
    for index in range(24):
        episode = get_episode(task, "test", index)

        found = mirrored_objects(episode, instruct(episode, "spatial", frame=frame))

        resolved = instruct(episode, "spatial", "resolved", frame=frame)
        assert mirrored_objects(episode, resolved) == found
        assert not mirrored_objects(episode, instruct(episode, "direct"))
        assert not found.keys() & frozenset().union(*found.values())  # what is meant is not
