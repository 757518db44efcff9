"""What an environment has in hand while an episode is played."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from roboirg.core.episode import Stage
from roboirg.judging import Event, plain_subgoal
from roboirg.simulation.controllers import Controller
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.observation_builder import ObservationBuilder
from roboirg.simulation.rendering.pixel_grounding import PixelGrounding


@dataclass
class EpisodeState:
    """What lasts from one reset to the next.

    Attributes:
        session: the episode.
        senses: what observations are read from.
        controller: turns actions into joint actions.
        grounding: names pixels, if that is asked for.
        felt: what was felt at each step of the video.
        labels: what was being done in each step of the video.
        history: what was seen since the last observation, as far as it is wanted.
        steps: control steps of the policy.
        reported: how many events have been told.
    """

    session: EpisodeSession
    senses: ObservationBuilder
    controller: Controller
    grounding: PixelGrounding | None
    felt: list[dict[str, Any]] = field(default_factory=list)
    labels: list[str] = field(default_factory=list)
    history: list[dict[str, Any]] = field(default_factory=list)
    steps: int = 0
    reported: int = 0

    def follow(self, stage: Stage | None) -> None:
        """To be called after each control step, with the stage whose label is current."""
        self.senses.proprioception.follow()
        if self.grounding is not None:
            self.grounding.update(stage)

    def label(self, stage: Stage) -> str:
        """A stage of the video in words, grounded if that is asked for."""
        return self.grounding.text if self.grounding else plain_subgoal(stage)

    def fresh_events(self) -> Sequence[Event]:
        """The events that have not been told yet."""
        fresh = self.session.events[self.reported :]
        self.reported += len(fresh)
        return fresh
