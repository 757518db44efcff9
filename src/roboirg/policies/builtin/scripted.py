"""A mind in front of the oracle's hands: whoever decides on a goal, the hands do it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from roboirg.core.conditions import Fact
from roboirg.core.episode import Goal, Stage
from roboirg.core.observations import Demonstration, Observation
from roboirg.judging import Judge
from roboirg.tasks import get_task

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

MAX_RETRIES = 3
"""How often in an episode the hands try again what did not work."""
UNDOES_PICK = frozenset({"place_on", "put_down", "drop_into", "put_into", "move_over"})
"""Primitives that need the object in the hand: to repeat one, it has to be picked up again."""


class ScriptedPolicy(ABC):
    """Decides on a goal at reset and then has the oracle's hands do it.

    Privileged: the hands know where everything is.
    """

    cameras: ClassVar[tuple[str, ...]] = ()

    def __init__(self, seed: int = 0) -> None:
        self.seed = seed
        self._env: RoboIRGEnv | None = None
        self._pieces: Iterator[NDArray[np.float64]] = iter(())

    @abstractmethod
    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal:
        """The goal that this policy takes to be meant."""

    def attach(self, env: RoboIRGEnv) -> None:
        """Get hold of the world in which the hands move."""
        self._env = env

    def reset(self, instruction: str, demonstration: Demonstration) -> None:  # noqa: ARG002
        """Decide what is meant and begin."""
        env = self._attached()
        goal = self.decide(env, instruction)
        stages = get_task(env.episode.task).stages(env.episode.scene, goal)
        self._pieces = _work(env, stages)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:  # noqa: ARG002
        """The next piece of movement; afterwards, to stay at rest."""
        piece = next(self._pieces, None)
        return piece if piece is not None else _rest(self._attached())

    def _attached(self) -> RoboIRGEnv:
        if self._env is None:
            raise RuntimeError(f"{type(self).__name__} needs attach(env) before reset().")
        return self._env


def _work(env: RoboIRGEnv, stages: tuple[Stage, ...]) -> Iterator[NDArray[np.float64]]:
    """Do one stage after the other; what did not work is tried again."""
    from roboirg.simulation.expert.primitives import MotionPrimitives

    hands, progress = MotionPrimitives(env.session.world), _Progress(env, stages)
    index, retries = 0, 0
    while index < len(stages):
        primitive = stages[index].primitive
        yield from hands.perform(primitive)
        if progress.completed() > index:
            index += 1
        elif retries < MAX_RETRIES:
            retries += 1
            index -= primitive.kind in UNDOES_PICK and index > 0
        else:
            return


class _Progress:
    """How many of the stages that somebody has in mind are completed.

    Args:
        env: where they are played; what happened before is not looked at.
        stages: what is to be completed, in order.
    """

    def __init__(self, env: RoboIRGEnv, stages: tuple[Stage, ...]) -> None:
        self._env = env
        self._judge = Judge(stages)
        self._facts: frozenset[Fact] = env.session.world.facts
        self._step = env.session.world.elapsed
        self._read = len(env.session.events)
        self._judge.update(self._step, self._facts)

    def completed(self) -> int:
        """The number of completed stages, now."""
        session = self._env.session
        changes = iter(session.events[self._read :])
        change = next(changes, None)
        while self._step < session.world.elapsed:
            self._step += 1
            while change is not None and change.step <= self._step:
                fact = frozenset([change.fact])
                self._facts = self._facts | fact if change.holds else self._facts - fact
                change = next(changes, None)
            self._judge.update(self._step, self._facts)
        self._read = len(session.events)
        return self._judge.index


def _rest(env: RoboIRGEnv) -> NDArray[np.float64]:
    """One second of staying where the robot is, with the gripper as it is."""
    robot = env.session.world.robot
    gripper = 1.0 if robot.finger_positions.min() > 0.039 else -1.0  # noqa: PLR2004
    return np.tile(np.append(robot.arm_positions, gripper), (20, 1))
