"""Workloads: stretches of real episodes with the oracle's actions."""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roboirg.core.episode import Episode
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.expert.primitives import MotionPrimitives
from roboirg.simulation.rendering.render_settings import FAITHFUL, RenderSettings
from roboirg.tasks.splits.splits import get_episode

STEPS = 48
"""Timed control steps of a stretch."""


@dataclass(frozen=True)
class Workload:
    """A stretch of an episode.

    Attributes:
        episode: the episode.
        before: untimed actions (n, 8) that lead to the stretch.
        actions: timed actions (`STEPS`, 8).
    """

    episode: Episode
    before: NDArray[np.float64]
    actions: NDArray[np.float64]

    def start(
        self, *, visible: bool = True, rendering: RenderSettings = FAITHFUL
    ) -> EpisodeSession:
        """Return the episode, played up to the stretch."""
        session = EpisodeSession(self.episode, visible=visible, rendering=rendering)
        for action in self.before:
            session.step(action)
        return session


def over_the_table() -> Workload:
    """Return a stretch in which the arm moves from home to above a cube, in the background."""
    return _stretch("PickXtimes", 2, first=4)


def as_in_demonstrations() -> Workload:
    """Return a stretch in which the arm works near the front camera, as in most long videos."""
    return _stretch("VideoPlaceButton", 0, first=130)


@functools.cache
def _stretch(task: str, index: int, first: int) -> Workload:
    """Play the first stages, of the demonstration or the policy, and cut out a stretch."""
    episode = get_episode(task, "test", index)
    session = EpisodeSession(episode, visible=False)
    expert, actions = MotionPrimitives(session.world), []
    stages = (*episode.demonstration, *episode.stages)
    for trajectory in itertools.chain.from_iterable(expert.execute(s.primitive) for s in stages):
        for action in trajectory:
            session.step(action)
            actions.append(action)
        if len(actions) >= first + STEPS:
            break
    return Workload(episode, np.stack(actions[:first]), np.stack(actions[first : first + STEPS]))
