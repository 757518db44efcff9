"""The objects that an episode's words are about: those that the goals of its task tell apart."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable, Sequence
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
    """Return the kinds of objects to point at in a task, in the order of its stages.

    These are the kinds of which different goals of a scene need different objects. If there are
    none, as where goals differ in a number only, it is the kind that the robot handles first.
    """
    task = get_task(task_name)
    pointed: list[ObjectKind] = []
    distinguished: set[ObjectKind] = set()
    handled: set[ObjectKind] = set()
    for episode in split_episodes([task_name], [SOURCE]):
        scene = episode.scene
        by_goal = [_pointed(task, scene, goal) for goal in task.goals(scene)]
        shared = set(by_goal[0]).intersection(*by_goal)
        for name in itertools.chain(*by_goal):
            kind = scene[name].kind
            pointed.append(kind)
            if name not in shared:
                distinguished.add(kind)
        handled.update(_first_handled(scene, by_goal[0]))
    wanted = distinguished or handled
    return tuple(kind for kind in dict.fromkeys(pointed) if kind in wanted)


def _first_handled(scene: Scene, names: Sequence[str]) -> list[ObjectKind]:
    """Return the kind of the first object but a button; none if there is none."""
    for name in names:
        if scene[name].kind != BUTTON:
            return [scene[name].kind]
    return []


def find_referents(episode: Episode) -> tuple[Referent, ...]:
    """Return the things that are meant, in the order in which they are handled.

    Where the things to handle are not there yet when the words are said, such as containers that
    appear later, they are the things from which they are told apart: the cubes in their places.
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
    """Return the word for a kind of object to point at."""
    task = get_task(task_name)
    if kind == task.things.handled and task.things.pointed != task.things.handled:
        kind = task.things.pointed
    return kind.removeprefix("hidden_")


def _pointed(task: Task, scene: Scene, goal: Goal) -> list[str]:
    """Return the objects at which the stages of a goal point, each once."""
    names: list[str] = []
    for stage in task.stages(scene, goal):
        name = stage.points_at
        if name is not None and name not in names:
            names.append(name)
    return names


def _seen_instead(task: Task, scene: Scene, name: str) -> str:
    """Return the object itself; of one that appears later, the cube in its place."""
    things = task.things
    appears_later = scene[name].kind == things.handled and things.handled != things.pointed
    inside = scene.hidden_in(name) if appears_later else None
    return name if inside is None else inside.name


def _by_color(scene: Scene, names: Iterable[str]) -> tuple[Referent, ...]:
    """Return a referent for each color: any object of a color is as good as another."""
    first_of: dict[object, SceneObject] = {}
    for name in names:
        first_of.setdefault(scene[name].color, scene[name])
    referents = []
    for color, first in first_of.items():
        objects = [item.name for item in scene.of_kind(first.kind) if item.color == color]
        referents.append(Referent(first.kind, tuple(objects)))
    return tuple(referents)
