"""The type of a task: plain data and pure functions that other packages read."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from roboirg.core.episode import COLORS, Color, Difficulty, Goal, ObjectKind, Scene, Stage, Suite
from roboirg.core.word_pools import Pools

_NUMBERED = re.compile(r"\{\w+\.\d+\}")
"""A field for one of several values, each of which is about an object."""


def _no_stages(_scene: Scene) -> tuple[Stage, ...]:
    return ()


class Wording(NamedTuple):
    """One wording of the command.

    Attributes:
        text: a sentence with a field for each part of the goal: ``{repeats}`` for a slot with one
            value, ``{colors.0}``, ``{colors.1}`` for a slot with several; ``{cubes}`` for all
            colors together with their counts.
        parts: number of objects that the sentence names one after the other.
    """

    text: str
    parts: int


def command_pools(*, train: tuple[str, ...], test: tuple[str, ...]) -> Pools[Wording]:
    """Return the sentences of a command as its wordings in both pools."""
    return Pools(tuple(map(_wording, train)), tuple(map(_wording, test)))


def _wording(text: str) -> Wording:
    numbered = set(_NUMBERED.findall(text))
    return Wording(text, len(numbered) or 1)


@dataclass(frozen=True, slots=True)
class Commands:
    """The commands of a task; the settings of the language fill the fields.

    Attributes:
        wordings: at least two for each number of parts, in each pool.
        thing: kind of object that the goal selects, and its name in words.
        colored: kind of object that has the goal's color: the same, or the cube in a container.
        colors: those that commands mention; color exclusion takes exactly three.
        by_color: how to refer to the object by a color; ``{cube}`` is the colored object.
        by_place: how to refer to the object by a place, after its count if it has one:
            ``cube[|s] ...``.
        by_rank: the same by ``the former`` or ``the first`` of several places; none if these words
            stand alone.
        pointed: kind of object that a place distinguishes among all objects of that kind: the
            colored one if the things to handle are not there yet.
        things_at: how to introduce one of them by its place.
    """

    wordings: Pools[Wording]
    thing: ObjectKind = "cube"
    colored: ObjectKind = "cube"
    colors: tuple[Color, ...] = COLORS
    by_color: str = "{cube}"
    by_place: str = "the cube {place}"
    by_rank: str | None = None
    pointed: ObjectKind = "cube"
    things_at: str = "the cube {place}"

    @property
    def names_sides(self) -> bool:
        """Whether some wording says left and right; a rank before it would sound like a place."""
        return any("left" in wording.text for wording in self.wordings.everything)


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
        commands: the wordings of its instruction.
        demonstration: stages that the oracle plays before the policy's turn.
        words: the file with its words in language 4, by its name in `language/scenarios` or by its
            whole path, such as ``str(Path(__file__).with_name("words.toml"))``; empty without any.
    """

    name: str
    suite: Suite
    code: int
    spatial: bool
    sample: Callable[[np.random.Generator, Difficulty], SceneAndGoal]
    goals: Callable[[Scene], tuple[Goal, ...]]
    stages: Callable[[Scene, Goal], tuple[Stage, ...]]
    commands: Commands
    demonstration: Callable[[Scene], tuple[Stage, ...]] = _no_stages
    words: str = ""
