"""The objects that an episode's words are about: those that the goals of its task tell apart."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from roboirg.core.episode import (
    Episode,
    Goal,
    ObjectKind,
    Scene,
    SceneObject,
    Split,
)
from roboirg.tasks import Task, get_task
from roboirg.tasks.splits.splits import split_episodes

SOURCE: Split = "train"
BUTTON = "button"


class Referent(NamedTuple):
    """One thing that is meant.

    Attributes:
        kind: of the things.
        objects: names of all objects that are equally right, in scene order.
    """

    kind: ObjectKind
    objects: tuple[str, ...]


def is_ordered(goal: Goal) -> bool:
    """Return whether the things of a goal have an order; amounts have none."""
    return "counts" not in goal.as_mapping()


@functools.cache
def pointed_kinds(task_name: str) -> tuple[ObjectKind, ...]:
    """Return the kinds of objects that a question asks to point at, such as ``("cube",)``.

    These are the kinds of which different goals of a scene need different objects, so that pointing
    shows which goal was understood. If there are none, as where goals differ in a number only, it
    is the kind that the robot handles first. They are found by looking at all scenes of the
    training split, and are in the order in which the stages first name them.
    """
    kinds = []
    differing = set()
    handled_first = set()
    for scene, names_by_goal in _scenes_of(task_name):
        kinds += _kinds_of(scene, itertools.chain(*names_by_goal))
        differing.update(_kinds_of(scene, _not_in_all(names_by_goal)))
        handled_first.update(_first_handled(scene, names_by_goal[0]))
    wanted = differing or handled_first
    return tuple(kind for kind in dict.fromkeys(kinds) if kind in wanted)


def _scenes_of(task_name: str) -> Iterator[tuple[Scene, list[list[str]]]]:
    """Yield the scenes of a task's training split, each with the objects of each possible goal.

    These are the names of the objects that the stages of the goal point at.
    """
    task = get_task(task_name)
    for episode in split_episodes([task_name], [SOURCE]):
        scene = episode.scene
        yield scene, [_pointed(task, scene, goal) for goal in task.goals(scene)]


def _kinds_of(scene: Scene, names: Iterable[str]) -> list[ObjectKind]:
    return [scene[name].kind for name in names]


def _not_in_all(lists: Sequence[Sequence[str]]) -> set[str]:
    """Return the names that are in one of some lists, at least, but not in all."""
    return set().union(*lists) - set(lists[0]).intersection(*lists)


def _first_handled(scene: Scene, names: Sequence[str]) -> list[ObjectKind]:
    """Return the kind of the first object that is no button, in a list; empty without any."""
    for name in names:
        if scene[name].kind != BUTTON:
            return [scene[name].kind]
    return []


def find_referents(episode: Episode) -> tuple[Referent, ...]:
    """Return the things in the first picture that an instruction means: those to point at.

    Red, then blue -> the red cube, the blue cube. They are in the order in which they are handled;
    if the goal says how many of each color, there is one for each color, as any object of a color
    is right. Things that are not there yet when the words are said, such as containers that appear
    later, are replaced by the cubes in their places.
    """
    task = get_task(episode.task)
    scene = episode.scene
    kinds = pointed_kinds(episode.task)
    names = [name for name in _pointed(task, scene, episode.goal) if scene[name].kind in kinds]
    if not is_ordered(episode.goal):
        return _by_color(scene, names)
    referents = []
    for name in names:
        seen = _seen_instead(task, scene, name)
        referents.append(Referent(scene[seen].kind, (seen,)))
    return tuple(referents)


def noun(task_name: str, kind: ObjectKind) -> str:
    """Return the word for a kind of object to point at: ``"hidden_cube"`` -> ``"cube"``.

    Containers that are not there yet when the words are said go by the word for what they will
    cover.
    """
    task = get_task(task_name)
    if kind == task.things.handled and task.things.pointed != task.things.handled:
        kind = task.things.pointed
    return kind.removeprefix("hidden_")


def _pointed(task: Task, scene: Scene, goal: Goal) -> list[str]:
    """Return the names of the objects that the stages of a goal point at, each once, in order.

    Red, twice, in PickXtimes -> ``["cube_red", "target", "button"]``.
    """
    names = []
    for stage in task.stages(scene, goal):
        name = stage.points_at
        if name is not None and name not in names:
            names.append(name)
    return names


def _seen_instead(task: Task, scene: Scene, name: str) -> str:
    """Return the name of the object; of a container that appears later, of the cube below it."""
    things = task.things
    appears_later = scene[name].kind == things.handled and things.handled != things.pointed
    inside = scene.hidden_in(name) if appears_later else None
    return name if inside is None else inside.name


def _by_color(scene: Scene, names: Iterable[str]) -> tuple[Referent, ...]:
    """Return one referent for each color of some objects, with all objects of the color.

    Any of them is right to point at, as the goal says only how many of each color.
    """
    first_of_color: dict[object, SceneObject] = {}
    for name in names:
        first_of_color.setdefault(scene[name].color, scene[name])
    referents = []
    for color, first in first_of_color.items():
        objects = [item.name for item in scene.of_kind(first.kind) if item.color == color]
        referents.append(Referent(first.kind, tuple(objects)))
    return tuple(referents)
