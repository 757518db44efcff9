"""Play an episode's demonstration: replay a recording of it, or plan it.

A replay of the same actions in the same world gives the same bits. A hash of the final state
verifies this, so results never depend on the cache. Where RoboMME's own recording is shipped, it is
replayed instead.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace

from roboirg.core.episode import Episode
from roboirg.core.errors import MotionPlanningError
from roboirg.simulation.recording import Recording
from roboirg.simulation.video.demonstration_cache import recording_key
from roboirg.util.cache import open_cache

PlayDemonstration = Callable[[Recording | None], Recording]
"""Starts the episode and plays its demonstration: replays the given recording, or plans if None."""

_log = logging.getLogger(__name__)


def replay_or_plan(
    episode: Episode, play: PlayDemonstration, shipped: Recording | None, *, watched: bool
) -> Recording:
    """Play a demonstration: replay it if it is shipped or cached, otherwise plan it and cache it.

    A demonstration is what the expert does before the policy's turn; an episode without one is
    only started.

    Args:
        episode: the episode.
        play: plays the demonstration; called again if a replay ends in another state.
        shipped: RoboMME's recording, if there is one. If it does not complete the stages, which
            no shipped one does where it was checked, the demonstration is planned.
        watched: whether a frame hook observes the steps. If so, no cached replay is used, because
            a wrong one would be noticed only at its end.

    Raises:
        MotionPlanningError: the demonstration cannot be executed; the scene cannot be used.
    """
    if not episode.demonstration:
        return replace(play(None), source="none")
    if shipped is not None:
        try:
            return replace(play(shipped), source="recorded")
        except MotionPlanningError as error:
            _log.warning("%s The recorded actions are not used; planning it.", error)
    cache = open_cache("actions")
    key = recording_key(episode)
    if not watched:
        content = cache.read(key)
        if content is not None:
            cached = Recording.from_bytes(content)
            if _replays_exactly(cached, play):
                return cached
            _log.warning(
                "The cache entry %s (%s) did not replay to the same state; planning it again.",
                key,
                episode.key,
            )
    planned = play(None)
    cache.write(key, planned.to_bytes())
    return planned


def _replays_exactly(recording: Recording, play: PlayDemonstration) -> bool:
    """Replay a recording; return whether it has ended in the same state."""
    try:
        return play(recording).end == recording.end
    except MotionPlanningError:
        return False
