"""Disk cache: files under keys, limited in size and safe against crashes.

An entry is written under a temporary name, flushed to the disk and renamed, so that a kill leaves
a complete entry or none. A checksum detects later damage. Any number of processes may read and
write. Errors of the disk never reach the caller: the cache then has no entries.

``ROBOIRG_CACHE`` names the folder, or is ``off``; ``ROBOIRG_CACHE_GIB`` limits its size.
"""

from __future__ import annotations

import hashlib
import logging
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, NamedTuple

from roboirg.core.errors import InvalidValueError
from roboirg.util.atomic_write import PART, replacing
from roboirg.util.user_folders import user_folder

FOLDER_VARIABLE = "ROBOIRG_CACHE"
SIZE_VARIABLE = "ROBOIRG_CACHE_GIB"
OFF = "off"
DEFAULT_GIB = 2.0
_GIB = 2**30

Kind = Literal["actions", "frames", "meshes"]
_SHARES: dict[Kind, float] = {"actions": 1 / 16, "frames": 14 / 16, "meshes": 1 / 16}
"""Shares of the size. Frames are large and cheap to render again; they must not evict the rest."""

_MAGIC = b"roboirg1"
_HEAD_SIZE = len(_MAGIC) + hashlib.sha256().digest_size
_ABANDONED_S = 600.0
"""Seconds after which an unfinished entry must belong to a dead process."""

_log = logging.getLogger(__name__)


class _Entry(NamedTuple):
    """An entry of a cache; those that were used longest ago are first in order.

    Attributes:
        used_at: when it was last read or written, ns.
        size: bytes of its file.
        path: of its file.
    """

    used_at: int
    size: int
    path: Path


class Cache:
    """Cache of one kind of entries in one folder; evicts the least recently used ones.

    Args:
        folder: created with the first entry; None disables the cache.
        limit: size limit of all entries together, bytes.
    """

    def __init__(self, folder: Path | None, limit: int) -> None:
        self._folder = folder
        self._limit = limit

    @property
    def enabled(self) -> bool:
        """Whether the cache stores anything."""
        return self._folder is not None

    def read(self, key: str) -> memoryview | None:
        """Return the content of an entry; None if it is missing or damaged, or the cache is off.

        A damaged entry is removed. Reading an entry makes it the newest, so that it is kept
        longest.
        """
        if self._folder is None:
            return None
        path = self._folder / key
        try:
            raw = path.read_bytes()
            content = memoryview(raw)[_HEAD_SIZE:]
            if raw[:_HEAD_SIZE] != _head(key, content):
                _log.warning("The cache entry %s is damaged and will be rebuilt.", path)
                path.unlink(missing_ok=True)
                return None
            os.utime(path)  # it was used now: `_make_room` removes the oldest
        except FileNotFoundError:
            return None
        except OSError as error:
            _warn_once(error)
            return None
        return content

    def write(self, key: str, content: bytes) -> None:
        """Store an entry; a failure is logged, not raised.

        Nothing is stored if the cache is off or the entry alone exceeds the limit. Other entries
        are removed to make room.
        """
        size = _HEAD_SIZE + len(content)
        if self._folder is None or size > self._limit:
            return
        try:
            with replacing(self._folder / key) as part:
                with part.open("xb") as file:
                    file.write(_head(key, content))
                    file.write(content)
                self._make_room(size)
        except (OSError, InvalidValueError) as error:
            _warn_once(error)

    def _make_room(self, size: int) -> None:
        """Remove the least recently used entries until `size` bytes more fit in the limit."""
        entries = sorted(self._entries())
        total = size + sum(entry.size for entry in entries)
        for entry in entries:
            if total <= self._limit:
                return
            entry.path.unlink(missing_ok=True)
            total -= entry.size

    def _entries(self) -> Iterator[_Entry]:
        """Yield the entries; remove files that were begun long ago and never completed."""
        for path in Path(self._folder or "").iterdir():
            try:
                state = path.stat()
                if not path.name.endswith(PART):
                    yield _Entry(state.st_mtime_ns, state.st_size, path)
                elif time.time() - state.st_mtime > _ABANDONED_S:
                    path.unlink(missing_ok=True)
            except FileNotFoundError:
                continue  # another process removed it


def open_cache(kind: Kind) -> Cache:
    """Return the cache of one kind of entries, as the environment variables configure it.

    It may be switched off; reading then finds nothing, and writing does nothing.
    """
    folder = cache_folder()
    if folder is None:
        return Cache(None, 0)
    return Cache(folder / kind, int(_size() * _SHARES[kind]))


def cache_folder() -> Path | None:
    """Return the folder of all caches; None if the environment variable disables them."""
    if os.environ.get(FOLDER_VARIABLE) == OFF:
        return None
    return user_folder("cache", FOLDER_VARIABLE)


def _size() -> float:
    """Return the size limit of all caches together, bytes, as the environment variable sets it.

    Raises:
        InvalidValueError: the variable is no positive number.
    """
    text = os.environ.get(SIZE_VARIABLE) or str(DEFAULT_GIB)
    try:
        size_gib = float(text)
    except ValueError:
        size_gib = 0.0
    if not 0.0 < size_gib < float("inf"):
        raise InvalidValueError(f"{SIZE_VARIABLE} is {text!r}; it must be a positive number.")
    return size_gib * _GIB


def _head(key: str, content: bytes | memoryview) -> bytes:
    """Return the head of an entry: a checksum of its key and content."""
    digest = hashlib.sha256(key.encode())
    digest.update(content)
    return _MAGIC + digest.digest()


_warned: set[type[BaseException]] = set()


def _warn_once(error: Exception) -> None:
    """Log an error of the cache, once in a process for each type of error."""
    kind = type(error.__cause__ or error)  # the disk's, whatever it was turned into
    if kind not in _warned:
        _warned.add(kind)
        _log.warning("The cache is unusable (%s); its entries will be rebuilt.", error)
