"""Files that save work: named by what determines them, bounded in size, safe against crashes.

An entry is written to another name, flushed to the disk and renamed, so that a kill leaves a whole
entry or none; it carries a checksum, so that damage done later is noticed. Any number of processes
may read and write. Nothing depends on a cache: where the disk refuses, there are no entries.

``ROBOIRG_CACHE`` names the folder, or is ``off``; ``ROBOIRG_CACHE_GIB`` is the most that it may
hold.
"""

from __future__ import annotations

import hashlib
import logging
import os
import secrets
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import platformdirs

from roboirg.core.errors import InvalidValueError

FOLDER_VARIABLE = "ROBOIRG_CACHE"
SIZE_VARIABLE = "ROBOIRG_CACHE_GIB"
OFF = "off"
USUAL_GIB = 2.0
_GIB = 2**30

Kind = Literal["actions", "frames", "meshes"]
_SHARES: dict[Kind, float] = {"actions": 1 / 16, "frames": 14 / 16, "meshes": 1 / 16}
"""Of the size. Frames are large and quick to draw again; they must not drive out the others."""

_MAGIC = b"roboirg1"
_HEAD_SIZE = len(_MAGIC) + hashlib.sha256().digest_size
_PART = ".part"
_ABANDONED = 600.0
"""Seconds after which an unfinished entry belongs to a process that is no more."""

_log = logging.getLogger(__name__)


class Cache:
    """Entries of one kind in one folder.

    Args:
        folder: made when something is kept; None keeps nothing.
        limit: bytes that all entries together may have; what has not been used for longest goes.
    """

    def __init__(self, folder: Path | None, limit: int) -> None:
        self._folder = folder
        self._limit = limit

    @property
    def keeps(self) -> bool:
        """Whether anything is kept at all."""
        return self._folder is not None

    def read(self, key: str) -> memoryview | None:
        """What was kept under a key; None if it is not there (any more) or damaged."""
        if self._folder is None:
            return None
        path = self._folder / key
        try:
            raw = path.read_bytes()
            content = memoryview(raw)[_HEAD_SIZE:]
            if raw[:_HEAD_SIZE] != _head(key, content):
                _log.warning("The cache entry %s is damaged; it is made anew.", path)
                path.unlink(missing_ok=True)
                return None
            os.utime(path)
        except FileNotFoundError:
            return None
        except OSError as error:
            _give_notice(error)
            return None
        return content

    def write(self, key: str, content: bytes) -> None:
        """Keep something; whether that works makes no difference to the caller."""
        size = _HEAD_SIZE + len(content)
        if self._folder is None or size > self._limit:
            return
        part = self._folder / f".{key}.{secrets.token_hex(8)}{_PART}"
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            try:
                with part.open("xb") as file:
                    file.write(_head(key, content))
                    file.write(content)
                    file.flush()
                    os.fsync(file.fileno())
                self._make_room(size)
                part.replace(self._folder / key)
            finally:
                part.unlink(missing_ok=True)
            _flush_folder(self._folder)
        except OSError as error:
            _give_notice(error)

    def _make_room(self, size: int) -> None:
        """Remove what has not been used for longest until so many bytes more fit in."""
        entries = sorted(self._entries())
        total = size + sum(held for _, held, _ in entries)
        for _, held, path in entries:
            if total <= self._limit:
                return
            path.unlink(missing_ok=True)
            total -= held

    def _entries(self) -> Iterator[tuple[int, int, Path]]:
        """When each entry was last used (ns), its bytes and path; sweeps out what was abandoned."""
        for path in Path(self._folder or "").iterdir():
            try:
                state = path.stat()
                if not path.name.endswith(_PART):
                    yield state.st_mtime_ns, state.st_size, path
                elif time.time() - state.st_mtime > _ABANDONED:
                    path.unlink(missing_ok=True)
            except FileNotFoundError:
                continue  # another process has made room


def open_cache(kind: Kind) -> Cache:
    """The cache of one kind of things, as the environment variables want it.

    Raises:
        InvalidValueError: ``ROBOIRG_CACHE_GIB`` is no positive number.
    """
    folder = cache_folder()
    if folder is None:
        return Cache(None, 0)
    return Cache(folder / kind, int(_size() * _SHARES[kind]))


def cache_folder() -> Path | None:
    """The folder of all caches, as the environment variable wants it; None for none."""
    named = os.environ.get(FOLDER_VARIABLE, "")
    if named == OFF:
        return None
    return Path(named).expanduser() if named else platformdirs.user_cache_path("roboirgbench")


def _size() -> float:
    """Bytes that all caches together may have."""
    text = os.environ.get(SIZE_VARIABLE) or str(USUAL_GIB)
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0.0 < number < float("inf"):
        raise InvalidValueError(f"{SIZE_VARIABLE} is {text!r}; it has to be a positive number.")
    return number * _GIB


def _head(key: str, content: bytes | memoryview) -> bytes:
    """What an entry begins with; it fits to no other key and no other content."""
    digest = hashlib.sha256(key.encode())
    digest.update(content)
    return _MAGIC + digest.digest()


def _flush_folder(folder: Path) -> None:
    number = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(number)
    finally:
        os.close(number)


_noticed: set[type[OSError]] = set()


def _give_notice(error: OSError) -> None:
    """Say what is wrong with the cache, once in a process for each kind of trouble."""
    if type(error) not in _noticed:
        _noticed.add(type(error))
        _log.warning("The cache cannot be used (%s); what it lacks is made anew.", error)
