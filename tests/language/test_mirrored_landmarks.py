"""Objects that an instruction's places mean with left and right exchanged."""

from __future__ import annotations

from collections import Counter

import pytest
from language_variants import split_episodes
from selection import slow_but

from roboirg.core.episode import Episode, SceneObject
from roboirg.language import instruct, mirrored_objects
from roboirg.language.landmarks import FRAMES, selectors
from roboirg.language.mirrored_landmarks import exchange_sides
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode

SPATIAL = tuple(name for name, task in every_task().items() if task.spatial)


def test_sides_are_exchanged_as_words() -> None:
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


@pytest.mark.parametrize("frame", slow_but(FRAMES[:1], FRAMES))
@pytest.mark.parametrize("task", SPATIAL)
def test_the_mirrored_object_is_what_the_exchanged_words_select(task: str, frame: str) -> None:
    seen: Counter[bool] = Counter()
    for episode in split_episodes(task):
        scene, thing = episode.scene, every_task()[task].commands.pointed
        found = mirrored_objects(episode, instruct(episode, "spatial", frame=frame))
        selected = {
            one.landmark.phrase: one.select()
            for one in reversed(list(selectors(scene, thing, frame)))  # type: ignore[arg-type]
        }
        for place in chosen(episode, frame):
            target, other = selected[place], selected.get(exchange_sides(place))
            assert target is not None
            mirrored = found.get(handled(target), frozenset())
            seen[bool(mirrored)] += 1
            if mirrored:
                assert other is not None
                assert other is not target
                assert handled(other) in mirrored
                # Where the goal counts cubes, a place tells their color only.
                assert len(mirrored) == 1 or task == "BinFill"
                colors = {scene[name].color for name in mirrored if scene[name].kind == "cube"}
                assert colors <= {other.color}
                assert colors or mirrored == {handled(other)}
    assert seen[True] >= 5


def test_what_the_words_mean_is_never_mirrored() -> None:
    for task in SPATIAL:
        for index in range(50):
            episode = get_episode(task, "test", index)
            found = mirrored_objects(episode, instruct(episode, "spatial"))
            assert not found.keys() & frozenset().union(*found.values())


def test_words_without_sides_have_no_mirrored_objects() -> None:
    for task in SPATIAL:
        for index in range(20):
            episode = get_episode(task, "test", index)
            assert not mirrored_objects(episode, instruct(episode, "direct"))
            if not any(" left" in one or " right" in one for one in chosen(episode, "robot")):
                assert not mirrored_objects(episode, instruct(episode, "spatial"))


def test_both_forms_have_the_same_mirrored_objects() -> None:
    episode = get_episode("VideoUnmask", "test", 1)
    resolved = instruct(episode, "spatial", "resolved")
    assert mirrored_objects(episode, resolved) == mirrored_objects(
        episode, instruct(episode, "spatial")
    )
