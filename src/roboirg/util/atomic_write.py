"""Files that appear whole or not at all, whatever is killed, and locks that end with a process."""

from __future__ import annotations

import contextlib
import fcntl
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

from roboirg.core.errors import InvalidValueError

PART = ".part"
"""End of the name of a file that is not whole yet."""


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a path next to `path` to write to; the file replaces `path` when the block ends.

    If the block raises, the partial file is removed and `path` stays as it was. Readers see the
    old or the new content, never a part, and the content is on the disk before the name is. A
    folder that is missing is made.
    """
    part = path.parent / f".{path.name}.{secrets.token_hex(8)}{PART}"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield part
        sync_to_disk(part)
        part.replace(path)
        sync_to_disk(path.parent)
    except OSError as error:
        raise InvalidValueError(f"Cannot write {path}: {error.strerror or error}.") from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def write_atomically(path: Path, content: str | bytes) -> None:
    """Replace a file by a text (as UTF-8) or by bytes, as `replacing` does."""
    with replacing(path) as part:
        part.write_bytes(content.encode() if isinstance(content, str) else content)


@contextlib.contextmanager
def locked(path: Path, taken: str) -> Iterator[None]:
    """Hold the lock of a file for one process alone, while the block runs; does not wait for it.

    File and folder are made if missing, and stay. The kernel releases the lock when the process
    ends, however it ends. A symbolic link is refused.

    Args:
        path: the file.
        taken: the message of the error if another process holds the lock.

    Raises:
        InvalidValueError: another process holds it, or it cannot be made.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
    except OSError as error:
        raise InvalidValueError(f"Cannot write {path}: {error.strerror}.") from error
    try:
        if not take_lock(descriptor, path):
            raise InvalidValueError(taken)
        yield
    finally:
        os.close(descriptor)


def take_lock(descriptor: int, path: Path, *, shared: bool = False) -> bool:
    """Lock an open file if no other process holds its lock; return whether it is locked now.

    Does not wait. The lock ends when the file is closed or the process ends.

    Args:
        descriptor: of the open file.
        path: of the file, for the error.
        shared: whether others that also share may hold it at the same time.

    Raises:
        InvalidValueError: its file system has no locks, as some network file systems.
    """
    try:
        fcntl.flock(descriptor, fcntl.LOCK_NB | (fcntl.LOCK_SH if shared else fcntl.LOCK_EX))
    except BlockingIOError:
        return False
    except OSError as error:
        raise InvalidValueError(
            f"Cannot lock {path} ({error.strerror}): its file system has no locks, as some network "
            "file systems; use a folder on a local disk."
        ) from error
    return True


def sync_to_disk(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
