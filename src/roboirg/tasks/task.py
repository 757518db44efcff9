"""What a task is: facts and pure functions that the other rooms read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from roboirg.core.episode import COLORS, Color, Difficulty, Goal, Scene, Stage, Suite

Thing = Literal["cube", "container", "box", "tape"]
"""What can be told by a place: its kind and its name in words."""


def _no_stages(_scene: Scene) -> tuple[Stage, ...]:
    return ()


class Wording(NamedTuple):
    """One way to say the command.

    Attributes:
        text: a sentence with a field for each part of the goal: ``{repeats}`` for a slot with one
            value, ``{colors.0}``, ``{colors.1}`` for a slot with several; ``{cubes}`` for all
            colors together with their counts.
        parts: how many things are handled one after the other in this sentence.
    """

    text: str
    parts: int = 1


@dataclass(frozen=True, slots=True)
class Commands:
    """How a task is commanded; the settings of the language fill the fields.

    Attributes:
        patterns: reasoning patterns, in the order in which the episodes cycle through them.
        wordings: at least two for each number of parts.
        thing: what the goal chooses among, for example ``"cube"``; places are told among all
            things of that kind.
        colored: what has the color that tells the thing: itself, or the cube in a container.
        colors: those that are spoken of; color exclusion takes exactly three.
        by_color: the thing told by a color; ``{cube}`` is what has that color.
        by_place: the thing told by a place, after its count if it has one: ``cube[|s] ...``.
    """

    patterns: tuple[str, ...]
    wordings: tuple[Wording, ...]
    thing: Thing = "cube"
    colored: Thing = "cube"
    colors: tuple[Color, ...] = COLORS
    by_color: str = "{cube}"
    by_place: str = "the cube {place}"


@dataclass(frozen=True, slots=True)
class Task:
    """One task, of the benchmark or of the real robot.

    Attributes:
        name: as in RoboMME and the paper, for example ``"PickXtimes"``.
        suite: the suite it belongs to.
        code: number of the task in the rule that gives an episode its seed.
        spatial: whether the spatial setting is defined for it.
        sample: scene and goal for a difficulty; raises SceneRejectedError when the seed
            yields no valid scene.
        goals: every goal that somebody could have in a scene, the listener's choices.
        stages: what must happen, in order, for a goal in a scene.
        commands: how it is commanded in words.
        demonstration: stages the oracle plays before the policy's turn.
    """

    name: str
    suite: Suite
    code: int
    spatial: bool
    sample: Callable[[np.random.Generator, Difficulty], tuple[Scene, Goal]]
    goals: Callable[[Scene], tuple[Goal, ...]]
    stages: Callable[[Scene, Goal], tuple[Stage, ...]]
    commands: Commands
    demonstration: Callable[[Scene], tuple[Stage, ...]] = _no_stages
