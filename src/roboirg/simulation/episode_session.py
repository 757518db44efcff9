"""One episode being played: the world, the judge, and the log of events."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import sapien.physx
from numpy.typing import NDArray

from roboirg.core.episode import Episode, Stage
from roboirg.core.errors import MotionPlanningError
from roboirg.judging import Event, Judge, Status, changes
from roboirg.simulation.bodies import Body
from roboirg.simulation.demonstration.recording import Move, Recording
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.simulation.rendering.render_mode import FAITHFUL, Rendering
from roboirg.simulation.world import World

StepHook = Callable[[Stage], object]


def _look_away(stage: Stage) -> None:
    del stage


class EpisodeSession:
    """Plays one episode from its first moment.

    Args:
        episode: what to play.
        visible: whether pictures are wanted at all.
        rendering: how they are made.

    Attributes:
        world: the simulator.
        judge: follows all stages, those of the demonstration first.
        events: everything that happened since the beginning.
    """

    def __init__(self, episode: Episode, *, visible: bool, rendering: Rendering = FAITHFUL) -> None:
        self.episode = episode
        self.world = World(episode.scene, visible=visible, rendering=rendering)
        self.judge = Judge((*episode.demonstration, *episode.stages), episode.scene)
        self.events: list[Event] = list(changes(0, frozenset(), self.world.facts))
        self._judge()

    @property
    def status(self) -> Status:
        """How the episode stands."""
        return self.judge.status

    def step(self, action: NDArray[np.floating[Any]]) -> None:
        """Execute one action (8) and judge what came of it."""
        before = self.world.facts
        now = self.world.step(action)
        self.events += changes(self.world.elapsed, before, now)
        self._judge()

    def play_demonstration(
        self, after_step: StepHook = _look_away, recording: Recording | None = None
    ) -> Recording:
        """Do the demonstration's stages, then one step at home.

        Args:
            after_step: called with the stage that the hands are doing after each control step of
                the demonstration that is in the video;
                not after the step at home, whose result is the policy's first observation.
            recording: what to replay; None lets the oracle's hands plan.

        Returns:
            What was done; its end is the recording's own if the replay was true.

        Raises:
            MotionPlanningError: a stage was not completed; the scene cannot be used.
        """
        done: list[Move] = []
        for move in self._planned() if recording is None else recording.moves():
            stage = self.episode.demonstration[move.stage]
            self.step(move.action)
            done.append(move)
            if stage.recorded:
                after_step(stage)
        if self.judge.index < len(self.episode.demonstration):
            raise MotionPlanningError(
                f"The demonstration of {self.episode.key} ended before stage {self.judge.index + 1}"
                f" of {len(self.episode.demonstration)} was complete."
            )
        self.step(HOME_ACTION)
        return Recording.of(done, self.state_hash())

    def state_hash(self) -> str:
        """SHA-256, in hexadecimal, of everything that can be known of the present state."""
        robot = self.world.robot.articulation
        numbers = [robot.get_qpos(), robot.get_qvel()]
        for body in self.world.bodies.values():
            numbers += _state(body)
        digest = hashlib.sha256()
        for array in numbers:
            digest.update(np.ascontiguousarray(array).tobytes())
        told = (self.world.elapsed, self.judge.index, str(self.judge.status), self.events)
        digest.update(repr(told).encode())
        return digest.hexdigest()

    def _planned(self) -> Iterator[Move]:
        """What the oracle's hands do; each piece is planned when the one before has been done."""
        if not self.episode.demonstration:
            return
        # What plans takes a third of a second to import; who only replays does not need it.
        from roboirg.simulation.expert.primitives import MotionPrimitives

        hands = MotionPrimitives(self.world)
        for index, stage in enumerate(self.episode.demonstration):
            for piece in hands.perform(stage.primitive):
                for action in piece:
                    yield Move(index, action)

    def _judge(self) -> None:
        self.judge.update(self.world.elapsed, self.world.facts)
        self.world.note_stage(self.judge.index)


def _state(body: Body) -> list[NDArray[Any]]:
    """Pose, velocities and joints of an object."""
    pose = body.entity.pose
    numbers = [pose.p, pose.q]
    if isinstance(body.physics, sapien.physx.PhysxRigidDynamicComponent):
        numbers += [body.physics.get_linear_velocity(), body.physics.get_angular_velocity()]
    if body.button is not None:
        numbers += [body.button.get_qpos(), body.button.get_qvel()]
    return numbers
