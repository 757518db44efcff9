"""What a task is: facts and pure functions that the other rooms read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from roboirg.episode import Difficulty, Goal, Motion, Scene, Stage, Suite


def _no_stages(_scene: Scene) -> tuple[Stage, ...]:
    return ()


def _no_motions(_scene: Scene) -> tuple[Motion, ...]:
    return ()


@dataclass(frozen=True, slots=True)
class Task:
    """One task of the benchmark.

    Attributes:
        name: as in RoboMME, for example ``"PickXtimes"``.
        suite: the suite it belongs to.
        code: number of the task in the rule that gives an episode its seed.
        spatial: whether the spatial setting is defined for it.
        sample: scene and goal for a difficulty; raises SceneRejectedError when the seed
            yields no valid scene.
        goals: every goal that somebody could have in a scene, the listener's choices.
        stages: what must happen, in order, for a goal in a scene.
        demonstration: stages the oracle plays before the policy's turn.
        motions: scripted movements of objects.
    """

    name: str
    suite: Suite
    code: int
    spatial: bool
    sample: Callable[[np.random.Generator, Difficulty], tuple[Scene, Goal]]
    goals: Callable[[Scene], tuple[Goal, ...]]
    stages: Callable[[Scene, Goal], tuple[Stage, ...]]
    demonstration: Callable[[Scene], tuple[Stage, ...]] = _no_stages
    motions: Callable[[Scene], tuple[Motion, ...]] = _no_motions

    @property
    def settings(self) -> tuple[str, ...]:
        """The settings in which the task can be stated, explicit first."""
        settings = ("explicit", "direct", "reasoning", "contextual")
        return (*settings, "spatial") if self.spatial else settings
