"""Cache of demonstrations: each is planned once, then its actions are replayed.

A replay of the same actions in the same world gives the same bits. A hash of the final state
verifies this, so results never depend on the cache. Where RoboMME's own recording is shipped, it is
replayed instead.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import logging
import platform
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from roboirg.core.episode import ENVIRONMENT_VERSION, Episode
from roboirg.core.errors import MotionPlanningError
from roboirg.simulation.recording import Recording
from roboirg.util.cache import open_cache
from roboirg.util.processor import processor_features

PlayDemonstration = Callable[[Recording | None], Recording]
"""Starts the episode and plays its demonstration: replays the given recording, or plans if None."""

_SOURCES = ("simulation", "judging", "tasks", "core")
"""Folders of this package that determine a demonstration, the hash of the model files included."""
_PACKAGES = ("sapien", "numpy", "scipy", "toppra")

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


def recording_key(episode: Episode) -> str:
    """Return a hash, in hexadecimal, of everything that determines a demonstration."""
    return hashlib.sha256(f"{_platform_fingerprint()}\n{episode!r}".encode()).hexdigest()


def _replays_exactly(recording: Recording, play: PlayDemonstration) -> bool:
    """Replay a recording; return whether it has ended in the same state."""
    try:
        return play(recording).end == recording.end
    except MotionPlanningError:
        return False


@functools.cache
def _platform_fingerprint() -> str:
    """Return everything but the episode: code, libraries, and the hardware that affects bits."""
    parts = [str(ENVIRONMENT_VERSION), _SOURCE_HASH, f"python {platform.python_version()}"]
    parts += [f"{package} {importlib.metadata.version(package)}" for package in _PACKAGES]
    # The planner's sines and cosines depend on the processor and the C library.
    parts += [platform.machine(), *platform.libc_ver(), processor_features()]
    return "\n".join(parts)


def _source_hash() -> str:
    """Return one hash of the names and contents of all Python files in `_SOURCES`."""
    root = Path(__file__).parents[2]
    digest = hashlib.sha256()
    for folder in _SOURCES:
        for file in sorted((root / folder).rglob("*.py")):
            content = file.read_bytes()
            digest.update(f"{file.relative_to(root)} {len(content)}\n".encode() + content)
    return digest.hexdigest()


_SOURCE_HASH = _source_hash()
"""Computed at import: files may change while the process runs the code it has loaded."""
