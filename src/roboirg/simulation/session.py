"""One episode being played: the world, the judge, and the log of events."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roboirg.episode import Episode, Stage
from roboirg.errors import MotionPlanningError
from roboirg.judging import Event, Judge, Status, changes
from roboirg.simulation.hands import Hands
from roboirg.simulation.settings import HOME_ACTION
from roboirg.simulation.world import World

StepHook = Callable[[Stage], None]


class Session:
    """Plays one episode from its first moment.

    Args:
        episode: what to play.
        visible: whether pictures are wanted at all.

    Attributes:
        world: the simulator.
        judge: follows all stages, those of the demonstration first.
        events: everything that happened since the beginning.
    """

    def __init__(self, episode: Episode, *, visible: bool) -> None:
        self.episode = episode
        self.world = World(episode.scene, visible=visible)
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

    def play_demonstration(self, after_step: StepHook) -> None:
        """Let the oracle's hands do the demonstration's stages, then one step at home.

        Args:
            after_step: called with the stage that the hands are doing after each control step of
                the demonstration that is in the video;
                not after the step at home, whose result is the policy's first observation.

        Raises:
            MotionPlanningError: a stage was not completed; the scene cannot be used.
        """
        hands = Hands(self.world)
        for stage in self.episode.demonstration:
            for piece in hands.perform(stage.primitive):
                for action in piece:
                    self.step(action)
                    if stage.recorded:
                        after_step(stage)
        if self.judge.index < len(self.episode.demonstration):
            raise MotionPlanningError(
                f"The demonstration of {self.episode.key} ended before stage {self.judge.index + 1}"
                f" of {len(self.episode.demonstration)} was complete."
            )
        self.step(HOME_ACTION)

    def _judge(self) -> None:
        self.judge.update(self.world.elapsed, self.world.facts)
        self.world.note_stage(self.judge.index)
