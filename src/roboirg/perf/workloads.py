"""What is played to be timed: stretches of real episodes, with the actions of the oracle."""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roboirg.core.episode import Episode
from roboirg.episodes.splits import get_episode
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.expert.primitives import MotionPrimitives
from roboirg.simulation.rendering.render_settings import FAITHFUL, RenderSettings

STEPS = 48
"""Control steps of a stretch that are timed."""


@dataclass(frozen=True)
class Workload:
    """A stretch of an episode.

    Attributes:
        episode: the episode.
        before: actions (n, 8) that lead to the stretch; they are not timed.
        actions: (`STEPS`, 8), those that are.
    """

    episode: Episode
    before: NDArray[np.float64]
    actions: NDArray[np.float64]

    def begun(
        self, *, visible: bool = True, rendering: RenderSettings = FAITHFUL
    ) -> EpisodeSession:
        """The episode, played up to the stretch."""
        session = EpisodeSession(self.episode, visible=visible, rendering=rendering)
        for action in self.before:
            session.step(action)
        return session


def over_the_table() -> Workload:
    """The arm moves from home to above a cube; seen from the front it is in the background."""
    return _stretch("PickXtimes", 2, first=4)


def as_in_demonstrations() -> Workload:
    """The arm works next to the front camera, as in most of the long videos."""
    return _stretch("VideoPlaceButton", 0, first=130)


@functools.cache
def _stretch(task: str, index: int, first: int) -> Workload:
    """The oracle's first stages of an episode, whoever they are for; cut to a stretch."""
    episode = get_episode(task, "test", index)
    session = EpisodeSession(episode, visible=False)
    hands, actions = MotionPrimitives(session.world), []
    stages = (*episode.demonstration, *episode.stages)
    for piece in itertools.chain.from_iterable(hands.perform(s.primitive) for s in stages):
        for action in piece:
            session.step(action)
            actions.append(action)
        if len(actions) >= first + STEPS:
            break
    return Workload(episode, np.stack(actions[:first]), np.stack(actions[first : first + STEPS]))
