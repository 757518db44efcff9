"""The objects that an episode's words are about: those that the goals of its task tell apart."""

from __future__ import annotations

import functools
import itertools
from typing import NamedTuple

from roboirg.core.episode import Episode, Goal, ObjectKind, Scene, Split
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
    found: dict[ObjectKind, None] = {}
    handled: dict[ObjectKind, None] = {}
    order: dict[ObjectKind, None] = {}
    for episode in split_episodes([task_name], [SOURCE]):
        by_goal = [_pointed(task, episode.scene, goal) for goal in task.goals(episode.scene)]
        shared = set.intersection(*map(set, by_goal))
        for name in itertools.chain.from_iterable(by_goal):
            kind = episode.scene[name].kind
            order[kind] = None
            if name not in shared:
                found[kind] = None
        first = (episode.scene[name].kind for name in by_goal[0])
        handled |= dict.fromkeys(itertools.islice((one for one in first if one != BUTTON), 1))
    return tuple(kind for kind in order if kind in (found or handled))


def find_referents(episode: Episode) -> tuple[Referent, ...]:
    """Return the things that are meant, in the order in which they are handled.

    Where the things to handle are not there yet when the words are said, such as containers that
    appear later, they are the things from which they are told apart: the cubes in their places.
    """
    task, scene = get_task(episode.task), episode.scene
    kinds = pointed_kinds(episode.task)
    names = [name for name in _pointed(task, scene, episode.goal) if scene[name].kind in kinds]
    if not is_ordered(episode.goal):
        return _by_color(scene, names)
    return tuple(
        Referent(scene[name].kind, (name,))
        for name in (_told_apart(task, scene, one) for one in names)
    )


def noun(task_name: str, kind: ObjectKind) -> str:
    """Return the word for a kind of object to point at."""
    task = get_task(task_name)
    if kind == task.commands.thing and task.commands.pointed != task.commands.thing:
        kind = task.commands.pointed
    return kind.removeprefix("hidden_")


def _pointed(task: Task, scene: Scene, goal: Goal) -> list[str]:
    """Return the objects at which the stages of a goal point, each once."""
    stages = task.stages(scene, goal)
    return list(dict.fromkeys(stage.points_at for stage in stages if stage.points_at is not None))


def _told_apart(task: Task, scene: Scene, name: str) -> str:
    commands = task.commands
    if scene[name].kind == commands.thing != commands.pointed:
        inside = scene.hidden_in(name)
        return name if inside is None else inside.name
    return name


def _by_color(scene: Scene, names: list[str]) -> tuple[Referent, ...]:
    """Return a referent for each color: any object of a color is as good as another."""
    found = []
    for color in dict.fromkeys(scene[name].color for name in names):
        first = next(scene[name] for name in names if scene[name].color == color)
        alike = (one.name for one in scene.of_kind(first.kind) if one.color == color)
        found.append(Referent(first.kind, tuple(alike)))
    return tuple(found)
