"""Demonstrations are planned once; after that their actions are replayed.

A replay gives the same bits as the planned demonstration: same world, same actions. That is
checked by a hash of the state at its end, so that nothing can depend on what is in the cache.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import logging
import platform
from collections.abc import Callable
from pathlib import Path

import roboirg
from roboirg.core.episode import ENVIRONMENT_VERSION, Episode
from roboirg.core.errors import MotionPlanningError
from roboirg.simulation.demonstration.recording import Recording
from roboirg.util.cache import open_cache

Attempt = Callable[[Recording | None], Recording]
"""Begins the episode, plays its demonstration, replayed or else planned, and says what was done."""

_SOURCES = (
    "simulation",
    "judging",
    "tasks",
    "core",
)
"""What in this package determines a demonstration; the hash of the model files is among it."""
_PACKAGES = ("sapien", "numpy", "scipy", "toppra")

_log = logging.getLogger(__name__)


def replay_or_plan(episode: Episode, attempt: Attempt, *, watched: bool) -> Recording:
    """Have a demonstration played: replayed if it is known, else planned and kept.

    Args:
        episode: whose demonstration.
        attempt: called once; a second time if the replay ended differently.
        watched: somebody looks on, who must see the right demonstration and nothing else, so that
            it is planned: whether a replay was true is known only at its end.

    Raises:
        MotionPlanningError: the demonstration cannot be done; the scene cannot be used.
    """
    if not episode.demonstration:
        return attempt(None)
    cache, key = open_cache("actions"), recording_key(episode)
    content = None if watched else cache.read(key)
    if content is not None:
        known = Recording.decoded(content)
        if _repeats(known, attempt):
            return known
        _log.warning(
            "The cache entry %s (%s) did not replay to the same end; it is planned anew.",
            key,
            episode.key,
        )
    made = attempt(None)
    cache.write(key, made.encoded())
    return made


def recording_key(episode: Episode) -> str:
    """A hash, in hexadecimal, of everything that determines a demonstration."""
    return hashlib.sha256(f"{_ground()}\n{episode!r}".encode()).hexdigest()


def _repeats(known: Recording, attempt: Attempt) -> bool:
    try:
        return attempt(known).end == known.end
    except MotionPlanningError:
        return False


@functools.cache
def _ground() -> str:
    """All but the episode: this package's code, the libraries, and what computes the last bits."""
    versions = [f"{package} {importlib.metadata.version(package)}" for package in _PACKAGES]
    python = f"python {platform.python_version()}"
    # The planner's sines and cosines depend on the processor and on the C library.
    machine = (platform.machine(), *platform.libc_ver(), _processor())
    return "\n".join([str(ENVIRONMENT_VERSION), _SOURCE_HASH, python, *versions, *machine])


def _source_hash() -> str:
    root = Path(roboirg.__file__).parent
    digest = hashlib.sha256()
    for name in _SOURCES:
        path = root / name
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            content = file.read_bytes()
            digest.update(f"{file.relative_to(root)} {len(content)}\n".encode() + content)
    return digest.hexdigest()


_SOURCE_HASH = _source_hash()
"""Taken now: files may be edited while the process goes on with the code that it has loaded."""


def _processor() -> str:
    """The processor's name and abilities."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    found = {line.partition(":")[0].strip(): line for line in reversed(lines)}
    return "\n".join(found.get(field, "") for field in ("model name", "flags", "Features"))
