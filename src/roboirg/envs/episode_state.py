"""State of an environment that lasts from one reset to the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from roboirg.core.delivery import HeardUtterance, SpokenInstruction
from roboirg.core.episode import Stage
from roboirg.judging import Event, plain_subgoal
from roboirg.simulation.controllers import Controller
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.observation_builder import ObservationBuilder
from roboirg.simulation.pixel_grounding import PixelGrounding


@dataclass
class EpisodeState:
    """State of one episode in an environment.

    Attributes:
        session: the episode.
        spoken: the instruction and what the policy has heard of it.
        observation_builder: reads observations.
        controller: converts actions to joint actions.
        pixel_grounding: finds the pixels of subgoals; None if not requested.
        video_proprioception: proprioception at each step of the video.
        video_subgoals: the subgoal in words at each step of the video.
        history: observations for ``history`` since the last observation.
        steps: control steps of the policy.
        executed_actions: number of actions of the policy that were executed, the last perhaps in
            part.
        reported_events: number of events that `take_new_events` has returned.
        reported_utterances: number of utterances that `take_new_utterances` has returned.
    """

    session: EpisodeSession
    spoken: SpokenInstruction
    observation_builder: ObservationBuilder
    controller: Controller
    pixel_grounding: PixelGrounding | None
    video_proprioception: list[dict[str, Any]] = field(default_factory=list)
    video_subgoals: list[str] = field(default_factory=list)
    history: list[dict[str, Any]] = field(default_factory=list)
    steps: int = 0
    executed_actions: int = 0
    reported_events: int = 0
    reported_utterances: int = 0

    def after_step(self, stage: Stage | None) -> None:
        """Update after a control step; call it after each one.

        Args:
            stage: the stage whose subgoal is published; None after the last.
        """
        self.observation_builder.proprioception.update()
        if self.pixel_grounding is not None:
            self.pixel_grounding.update(stage)

    def describe_stage(self, stage: Stage) -> str:
        """Return the subgoal of a video's stage in words; with its object's pixel if requested."""
        if self.pixel_grounding is not None:
            return self.pixel_grounding.text
        return plain_subgoal(stage)

    def take_new_events(self) -> Sequence[Event]:
        """Return the events since the last call; they are not returned again."""
        new_events = self.session.events[self.reported_events :]
        self.reported_events += len(new_events)
        return new_events

    def take_new_utterances(self) -> Sequence[HeardUtterance]:
        """Return the utterances that the policy has heard since the last call, each once."""
        new_utterances = self.spoken.heard[self.reported_utterances :]
        self.reported_utterances += len(new_utterances)
        return new_utterances
