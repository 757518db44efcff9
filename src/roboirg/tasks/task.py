"""The type of a task: plain data and pure functions that other packages read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from roboirg.core.episode import COLORS, Color, Difficulty, Goal, ObjectKind, Scene, Stage, Suite


def _no_stages(_scene: Scene) -> tuple[Stage, ...]:
    return ()


class GoalThings(NamedTuple):
    """The kinds of things that the goals of a task are about, and their colors.

    Attributes:
        handled: kind of object that the goal selects.
        colored: kind of object that has the goal's color: the same, or the cube in a container.
        pointed: kind of object that a place distinguishes among all objects of that kind: the
            colored one if the things to handle are not there yet.
        colors: those that words can mention; color exclusion takes exactly three.
    """

    handled: ObjectKind = "cube"
    colored: ObjectKind = "cube"
    pointed: ObjectKind = "cube"
    colors: tuple[Color, ...] = COLORS


PLAIN_CUBES = GoalThings()
"""Of most tasks."""

SceneAndGoal = tuple[Scene, Goal]
"""What the seed of an episode gives."""


@dataclass(frozen=True, slots=True)
class Task:
    """One task, of this package or another (docs/add-task.md).

    Attributes:
        name: as in RoboMME and the paper, for example ``"PickXtimes"``.
        suite: its suite.
        code: unique number from which the seeds of its episodes follow.
        spatial: whether the spatial setting is defined for it.
        sample: draws scene and goal for a difficulty; raises SceneRejectedError if the seed yields
            no valid scene.
        goals: every possible goal in a scene, among which the listener chooses.
        stages: what must happen, in order, for a goal in a scene.
        demonstration: stages that the oracle plays before the policy's turn.
        things: what its goals are about; plain cubes as a rule.
        words: the file with its words, by its name in `language/scenarios` or by its
            whole path, such as ``str(Path(__file__).with_name("words.toml"))``; empty without any.
    """

    name: str
    suite: Suite
    code: int
    spatial: bool
    sample: Callable[[np.random.Generator, Difficulty], SceneAndGoal]
    goals: Callable[[Scene], tuple[Goal, ...]]
    stages: Callable[[Scene, Goal], tuple[Stage, ...]]
    demonstration: Callable[[Scene], tuple[Stage, ...]] = _no_stages
    things: GoalThings = PLAIN_CUBES
    words: str = ""
