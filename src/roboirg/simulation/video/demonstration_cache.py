"""The key of a demonstration in the cache: each is planned once, then its actions are replayed."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import platform
from pathlib import Path

from roboirg.core.episode import ENVIRONMENT_VERSION, Episode
from roboirg.util.processor import processor_features

_SOURCES = ("simulation", "judging", "tasks", "core")
"""Folders of this package that determine a demonstration, the hash of the model files included."""
_PACKAGES = ("sapien", "numpy", "scipy", "toppra")


def recording_key(episode: Episode) -> str:
    """Return a hash, in hexadecimal, of everything that determines a demonstration."""
    return hashlib.sha256(f"{_platform_fingerprint()}\n{episode!r}".encode()).hexdigest()


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
