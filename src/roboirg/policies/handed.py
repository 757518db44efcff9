"""A mind in front of the oracle's hands: whoever decides on a goal, the hands do it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from roboirg.episode import Fact, Goal, Stage
from roboirg.observations import Demonstration, Observation
from roboirg.tasks import get_task

if TYPE_CHECKING:
    from roboirg.environment import RoboIRGEnv

MAX_RETRIES = 3
"""How often in an episode the hands try again what did not work."""
UNDOES_PICK = frozenset({"place_on", "put_down"})
"""Primitives that need the object in the hand: to repeat one, it has to be picked up again."""


class HandedPolicy(ABC):
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
    from roboirg.simulation.hands import Hands

    hands = Hands(env.session.world)
    index, retries = 0, 0
    while index < len(stages):
        stage, seen = stages[index], len(env.events)
        yield from hands.perform(stage.primitive)
        if _happened(env, stage.expects, seen):
            index += 1
        elif retries < MAX_RETRIES:
            retries += 1
            index -= stage.primitive.kind in UNDOES_PICK and index > 0
        else:
            return


def _happened(env: RoboIRGEnv, fact: Fact, since: int) -> bool:
    """Whether the fact began to hold after the first `since` events, or holds now."""
    fresh = env.events[since:]
    return fact in env.session.world.facts or any(
        event.fact == fact and event.holds for event in fresh
    )


def _rest(env: RoboIRGEnv) -> NDArray[np.float64]:
    """One second of staying where the robot is, with the gripper as it is."""
    robot = env.session.world.robot
    gripper = 1.0 if robot.finger_positions.min() > 0.039 else -1.0  # noqa: PLR2004
    return np.tile(np.append(robot.arm_positions, gripper), (20, 1))
