"""The base class of policies that decide on a goal and execute it with the scripted expert."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import Actions
from roboirg.core.episode import HANDLES_HELD, Goal, Stage
from roboirg.core.observations import Demonstration, Observation
from roboirg.judging import Judge
from roboirg.judging.episode_replay import facts_by_step
from roboirg.policies.contract.base import AttachedPolicy
from roboirg.tasks import get_task, with_goal

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv
    from roboirg.simulation.expert.primitives import MotionPrimitives

_StagedChunk = tuple[Stage | None, NDArray[np.float64]]
"""A stage of the goal and a chunk of its actions (n, 8); no stage while the command is awaited."""

_OPEN_FINGERS = 0.039
"""Meters from the middle beyond which both fingers are where the gripper is open."""
_STILL_STEPS = 20
"""Control steps of a chunk that holds still: one second."""

LISTENING_STEPS = 5
"""Control steps at rest between two observations while the command has not been heard."""
MAX_RETRIES = 3
"""Retries of failed primitives per episode."""

WORDLESS: Mapping[str, str] = {
    "network": "none",
    "device": "processor of the machine of the simulation",
    "trained_on": "none",
    "reads_text": "no",
}
"""Metadata of policies without networks that ignore what is said."""
READING: Mapping[str, str] = {
    **WORDLESS,
    "trained_on": "its rules are written for the words of both pools, train and test",
    "reads_text": "yes",
    "text_normalization": "lower case, split into words and punctuation",
}
"""Metadata of policies without networks that go by the words."""


class ScriptedPolicy(AttachedPolicy, ABC):
    """Decides on a goal once it has heard the command, and executes it with the scripted expert.

    Privileged: the expert reads the poses of all objects. It remembers everything that is said, and
    rests until the command, the last utterance; where every goal of the scene begins above the same
    object, it goes there meanwhile. A subclass says how to decide (`decide`).

    Attributes:
        listens: whether it waits for the command.
        stages: of the goal that it has decided on; empty before, and if there is none.
        stage: the stage that the last actions belong to; None before the first ones.
    """

    cameras: tuple[str, ...] = ()
    listens: ClassVar[bool] = True

    def __init__(self, seed: int = 0) -> None:
        self.seed = seed
        # No generator of a method: the cycle would keep the world until the next collection.
        self._chunks: Iterator[_StagedChunk] = iter(())
        self.stage: Stage | None = None

    def make_primitives(self, env: RoboIRGEnv) -> MotionPrimitives:
        """Return what plans the motions of the stages, on the world of an environment."""
        from roboirg.simulation.expert.primitives import MotionPrimitives

        return MotionPrimitives(env.session.world)

    @abstractmethod
    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal | None:
        """Return the goal to execute, one of the scene's; None to hold still.

        Args:
            env: whose simulator the policy may read.
            instruction: everything that was said, joined by spaces.
        """

    def reset(self, instruction: str, demonstration: Demonstration) -> None:  # noqa: ARG002
        """Begin an episode: decide on a goal, or wait for the rest of the instruction.

        It waits if it listens and something is still to be said, which `hear` will bring.
        """
        self._heard = [instruction]
        self.stages: tuple[Stage, ...] = ()
        if self.listens and self.env.unheard:
            self._chunks = _get_ready(self.env)
        else:
            self.begin(self.env)

    def hear(self, text: str, step: int) -> None:  # noqa: ARG002
        """Remember an utterance, and decide on a goal if it was the last one."""
        self._heard.append(text)
        if self.listens and len(self._heard) == len(self.env.instruction.utterances):
            self.begin(self.env)

    def begin(self, env: RoboIRGEnv) -> None:
        """Decide on a goal and plan its stages; everything has been heard."""
        goal = self.decide(env, " ".join(self._heard))
        self.stages = () if goal is None else with_goal(env.episode, goal).stages
        self._chunks = _execute(env, self.stages, self.make_primitives(env))

    def act(self, observation: Observation) -> Actions:  # noqa: ARG002
        """Return the next actions (n, 8) of the motion; after its end, one second at rest."""
        staged = next(self._chunks, None)
        if staged is None:
            return _hold_still(self.env)
        self.stage, chunk = staged
        return chunk


def _execute(
    env: RoboIRGEnv, stages: tuple[Stage, ...], primitives: MotionPrimitives
) -> Iterator[_StagedChunk]:
    """Yield chunks of actions (n, 8), stage by stage; a stage that is not completed is retried.

    A stage that handles what is held, such as placing it, is retried from the stage before, which
    picks it up. If a stage fails after `MAX_RETRIES` retries in all, the chunks end.

    Args:
        env: in which the caller executes each chunk before it takes the next one.
        stages: of the goal.
        primitives: the expert, which plans the motion of a stage.
    """
    index = 0
    retries = 0
    since = env.session.world.elapsed
    while index < len(stages):
        stage = stages[index]
        for chunk in primitives.execute(stage.primitive):
            yield stage, chunk
        if completed_stages(env, stages, since) > index:
            index += 1
        elif retries < MAX_RETRIES:
            retries += 1
            if stage.primitive.kind in HANDLES_HELD and index > 0:
                index -= 1
        else:
            return


def _get_ready(env: RoboIRGEnv) -> Iterator[_StagedChunk]:
    """Yield chunks of actions for the time before the goal is known; it never ends.

    If all goals of the scene begin with a hover over the same object, that comes first. Then there
    are rests of `LISTENING_STEPS`, short so that the next words are heard soon.
    """
    from roboirg.simulation.expert.primitives import MotionPrimitives

    scene = env.episode.scene
    task = get_task(env.episode.task)
    beginnings = {task.stages(scene, goal)[0].primitive for goal in task.goals(scene)}
    if len(beginnings) == 1:
        (beginning,) = beginnings
        if beginning.kind == "hover":
            for chunk in MotionPrimitives(env.session.world).execute(beginning):
                yield None, chunk
    while True:
        yield None, _hold_still(env)[:LISTENING_STEPS]


def completed_stages(env: RoboIRGEnv, stages: tuple[Stage, ...], since: int) -> int:
    """Return how many stages of a goal are completed now, in their order.

    Args:
        env: with the events of the episode.
        stages: of the goal, which need not be that of the episode.
        since: control step of the world from which on facts count.
    """
    judge = Judge(stages)
    now = env.session.world.elapsed
    facts = facts_by_step(env.session.events, now)
    for step in range(since, now + 1):
        judge.update(step, facts[step])
    return judge.index


def _hold_still(env: RoboIRGEnv) -> NDArray[np.float64]:
    """Return one second of actions (20, 8) that keep the arm and the gripper as they are."""
    robot = env.session.world.robot
    is_open = robot.finger_positions.min() > _OPEN_FINGERS
    gripper = 1.0 if is_open else -1.0
    return np.tile(np.append(robot.arm_positions, gripper), (_STILL_STEPS, 1))
