"""One episode in progress: the world, the judge, and the log of events."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import sapien.physx
from numpy.typing import NDArray

from roboirg.core.actions import Actions
from roboirg.core.episode import Episode, Stage
from roboirg.core.errors import MotionPlanningError
from roboirg.judging import Event, Judge, Status, changes
from roboirg.simulation.bodies import Body
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.simulation.recording import RecordedStep, Recording
from roboirg.simulation.rendering.render_settings import FAITHFUL, RenderSettings
from roboirg.simulation.world import World

StepHook = Callable[[Stage], object]
"""Called with the current stage after a control step."""


def _do_nothing(stage: Stage) -> None:
    """Ignore the stage: a hook for those who want none."""
    del stage


class EpisodeSession:
    """One episode, from its start.

    Attributes:
        demonstrated: the recording of the demonstration as it was executed, once it has ended.
        world: the simulator.
        judge: follows all stages, those of the demonstration first.
        original: follows the stages to the scene's own goal in the same way, if the episode has
            another one; else None.
        events: all events since the start: a fact, such as *picked, cube 1*, begins or ceases to
            hold.
        attempts: the same of attempts, facts about what the hand tries; nothing is judged by them,
            but causes of failures are found from them.
    """

    demonstrated: Recording

    def __init__(
        self,
        episode: Episode,
        *,
        visible: bool,
        rendering: RenderSettings = FAITHFUL,
        original: Episode | None = None,
    ) -> None:
        self.episode = episode
        self.world = World(episode.scene, visible=visible, rendering=rendering)
        self.judge = Judge.of(episode)
        self.original = None if original is None else Judge.of(original)
        self.events: list[Event] = list(changes(0, frozenset(), self.world.facts))
        self.attempts: list[Event] = []
        self._judge()

    @property
    def status(self) -> Status:
        """Status of the episode."""
        return self.judge.status

    @property
    def is_decided(self) -> bool:
        """Whether the verdict has fallen, on the original goal as well if there is one."""
        return all(judge.status is not Status.ONGOING for judge in self._judges)

    def fail(self, cause: str) -> None:
        """End the episode as a failure of every goal that is not decided yet."""
        for judge in self._judges:
            judge.fail(cause)

    def step(self, action: Actions) -> None:
        """Execute one action (8) and judge the result."""
        last_facts = self.world.facts
        last_attempts = self.world.attempts
        self.world.step(action)
        self.events += changes(self.world.elapsed, last_facts, self.world.facts)
        self.attempts += changes(self.world.elapsed, last_attempts, self.world.attempts)
        self._judge()

    def demonstrate(self, recording: Recording | None = None) -> Iterator[Stage]:
        """Execute the demonstration's stages, then one step at home; set `demonstrated` at the end.

        Args:
            recording: the demonstration to replay; None plans it with the scripted expert.

        Yields:
            The current stage after each control step that the video contains; not after the step
            at home, which gives the policy's first observation.

        Raises:
            MotionPlanningError: a stage was not completed; the scene cannot be used.
        """
        stages = self.episode.demonstration
        steps = self._plan_demonstration() if recording is None else recording.steps()
        executed = []
        for step in steps:
            stage = stages[step.stage]
            self.step(step.action)
            executed.append(step)
            if stage.in_video:
                yield stage
        if self.judge.index < len(stages):
            raise MotionPlanningError(
                f"The demonstration of {self.episode.key} ended before stage {self.judge.index + 1}"
                f" of {len(stages)} was complete."
            )
        self.step(HOME_ACTION)
        self.demonstrated = Recording.from_steps(executed, self.state_hash())

    def play_demonstration(
        self, after_step: StepHook = _do_nothing, recording: Recording | None = None
    ) -> Recording:
        """Play the demonstration as `demonstrate` does, with a call for each stage that it yields.

        Returns:
            The recording of what was executed; an exact replay has the same `end` as `recording`.

        Raises:
            MotionPlanningError: a stage was not completed; the scene cannot be used.
        """
        for stage in self.demonstrate(recording):
            after_step(stage)
        return self.demonstrated

    def state_hash(self) -> str:
        """Return the SHA-256, in hexadecimal, of all readable state."""
        digest = hashlib.sha256()
        for array in self._state():
            digest.update(np.ascontiguousarray(array).tobytes())
        progress = (self.world.elapsed, self.judge.index, str(self.judge.status), self.events)
        digest.update(repr(progress).encode())
        return digest.hexdigest()

    def state_numbers(self) -> NDArray[np.float64]:
        """Return positions and velocities of the robot's joints, then those of all objects, (m,).

        Units: rad, m and s. An object has its position and orientation (w, x, y, z), its linear and
        angular velocity if it can move, and a button the position and velocity of its joint.
        """
        numbers = [np.asarray(array, np.float64).ravel() for array in self._state()]
        return np.concatenate(numbers)

    def _state(self) -> list[NDArray[Any]]:
        """Return the arrays of `state_numbers`, of any shape and type; `state_hash` hashes them."""
        robot = self.world.robot.articulation
        numbers = [robot.get_qpos(), robot.get_qvel()]
        for body in self.world.bodies.values():
            numbers += _body_state(body)
        return numbers

    def _plan_demonstration(self) -> Iterator[RecordedStep]:
        """Yield the scripted expert's steps; each trajectory is planned after the last is done."""
        if not self.episode.demonstration:
            return
        # Importing the planner takes a third of a second, and replays do not need it.
        from roboirg.simulation.expert.primitives import MotionPrimitives

        expert = MotionPrimitives(self.world)
        for index, stage in enumerate(self.episode.demonstration):
            for trajectory in expert.execute(stage.primitive):
                for action in trajectory:
                    yield RecordedStep(index, action)

    @property
    def _judges(self) -> tuple[Judge, ...]:
        """The judges of all goals that are followed: one or two."""
        if self.original is None:
            return (self.judge,)
        return self.judge, self.original

    def _judge(self) -> None:
        """Show the judges the facts of this step, and tell the world which stage is due."""
        for judge in self._judges:
            judge.update(self.world.elapsed, self.world.facts)
        self.world.note_stage(self.judge.index)


def _body_state(body: Body) -> list[NDArray[Any]]:
    """Return position, quaternion, velocities and joints of an object, as far as it has them."""
    pose = body.entity.pose
    numbers = [pose.p, pose.q]
    if isinstance(body.physics, sapien.physx.PhysxRigidDynamicComponent):
        numbers += [body.physics.get_linear_velocity(), body.physics.get_angular_velocity()]
    if body.button is not None:
        numbers += [body.button.get_qpos(), body.button.get_qvel()]
    return numbers
