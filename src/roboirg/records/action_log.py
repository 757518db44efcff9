"""The actions of an episode, in a file next to the records, so that anyone can play them again.

A file is named after the SHA-256 of its content, and the record holds that name. `numpy.load` reads
it: ``space`` (name of the action space), ``rows`` (n, 8 or 7), ``requests`` (k,) and ``end_state``.
"""

from __future__ import annotations

import hashlib
import io
import lzma
import re
import struct
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import CheckedActions, check_chunk, find_action_space
from roboirg.core.errors import InvalidActionError, InvalidValueError
from roboirg.records.record_codec import StoreError
from roboirg.util.atomic_write import write_atomically
from roboirg.util.regular_file import read_regular

ACTION_FOLDER = "actions"
_SUFFIX = ".npz"
_DIGEST = re.compile("[0-9a-f]{64}")
_KINDS = {"space": "U", "rows": "f", "requests": "i", "end_state": "f"}
"""The arrays of a file, and NumPy's letter for the kind of their numbers or text."""
_MAX_BYTES = 16_777_216
"""Largest content that is unpacked; an episode of 1300 steps has less than 0.2 MB."""
UNREADABLE_ARCHIVE = (
    ArithmeticError, EOFError, KeyError, MemoryError, OSError, RuntimeError, SyntaxError, TypeError,
    ValueError, lzma.LZMAError, struct.error, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
"""Raised by `zipfile` and NumPy for content that is damaged, encrypted or odd."""


@dataclass(frozen=True, eq=False)
class ActionLog:
    """What a policy did in an episode, and where that left the world.

    Attributes:
        space: name of the action space.
        rows: the executed actions, (n, size).
        requests: for each answer of the policy, in order, the index of its first row, (k,).
        end_state: positions and velocities of the robot's joints and of all objects at the end, as
            in `EpisodeSession.state_numbers`, (m,).
    """

    space: str
    rows: CheckedActions
    requests: NDArray[np.int32]
    end_state: NDArray[np.float64]

    @property
    def digest(self) -> str:
        """SHA-256 of the content, in hexadecimal; it does not depend on the compression."""
        digest = hashlib.sha256(self.space.encode())
        for array in (self.rows, self.requests, self.end_state):
            digest.update(f"|{array.shape}|".encode())
            digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()

    def chunks(self) -> list[CheckedActions]:
        """Return the actions (n, size) of each answer of the policy, in order; none without any.

        Rows 0 to 4, answers that begin with rows 0 and 3 -> three rows, then two.
        """
        if not len(self.requests):
            return []
        return np.split(self.rows, self.requests[1:])


def action_path(folder: Path, digest: str) -> Path:
    """Return where the actions with this digest are in the folder of a run.

    Raises:
        StoreError: it is not a digest, so it would be another file's name.
    """
    if not _DIGEST.fullmatch(digest):
        raise StoreError(f"{digest!r} is not a digest of actions, which has 64 hexadecimal digits.")
    return folder / ACTION_FOLDER / digest[:2] / f"{digest}{_SUFFIX}"


def write_actions(log: ActionLog, folder: Path) -> str:
    """Store the actions of an episode in the folder of a run; return their digest.

    Raises:
        InvalidValueError: the file cannot be written.
    """
    digest = log.digest
    path = action_path(folder, digest)
    if not path.exists():
        write_atomically(path, _pack(log))
    return digest


def read_actions(folder: Path, digest: str) -> ActionLog:
    """Return the actions of an episode, read from the folder of its run.

    Args:
        folder: of the run.
        digest: SHA-256 of the actions, from the episode's record; the file is named after it.

    Raises:
        StoreError: the file is missing, is no action log, or has another content than its name
            says; or the digest is none.
    """
    path = action_path(folder, digest)
    try:
        log = _unpack(read_regular(path, _MAX_BYTES))
    except FileNotFoundError:
        raise StoreError(f"The actions {path} are missing.") from None
    except (InvalidActionError, InvalidValueError, *UNREADABLE_ARCHIVE) as error:
        raise StoreError(f"{path} is not an action log: {error}") from error
    if log.digest != digest:
        raise StoreError(f"{path} does not have the content that its name gives, but {log.digest}.")
    return log


def _pack(log: ActionLog) -> bytes:
    """Return the content of a compressed NumPy file (.npz) with the actions of an episode.

    `_unpack` is the reverse; no number changes.
    """
    file = io.BytesIO()
    # Column by column: the numbers of one joint resemble each other, so they take less space.
    rows = np.asfortranarray(log.rows)
    arrays = {
        "space": np.array(log.space),
        "rows": _shortest(rows),
        "requests": log.requests,
        "end_state": _shortest(log.end_state),
    }
    np.savez_compressed(file, allow_pickle=False, **arrays)
    return file.getvalue()


def _shortest(numbers: NDArray[np.float64]) -> NDArray[np.floating]:
    """Return the numbers as float32 if none of them changes, which is so for most policies."""
    as_float32 = numbers.astype(np.float32)
    return as_float32 if np.array_equal(as_float32, numbers) else numbers


def _unpack(content: bytes) -> ActionLog:
    """Return the actions in the content of a NumPy file (.npz), the reverse of `_pack`.

    The file may be a stranger's, so size, types and values are checked; numbers become float64
    again.

    Raises:
        ValueError: an array has another type, or the answers do not fit the rows.
        InvalidActionError: an action cannot be executed.
    """
    file = io.BytesIO(content)
    # First the size, as a small file may unpack to a huge one.
    with zipfile.ZipFile(file) as archive:
        size = sum(entry.file_size for entry in archive.infolist())
    if size > _MAX_BYTES:
        raise ValueError(f"it unpacks to {size:,} bytes; at most {_MAX_BYTES:,} are read.")
    with np.load(file, allow_pickle=False) as stored:
        arrays = {name: np.asarray(stored[name]) for name in _KINDS}
    for name, kind in _KINDS.items():
        if arrays[name].dtype.kind != kind:
            raise ValueError(f"{name} has the type {arrays[name].dtype}.")

    log = ActionLog(
        space=str(arrays["space"]),
        rows=np.ascontiguousarray(arrays["rows"], dtype=np.float64),
        requests=arrays["requests"].astype(np.int32),
        end_state=arrays["end_state"].astype(np.float64),
    )
    if log.rows.size:
        check_chunk(log.rows, find_action_space(log.space))
    _check_requests(log.requests, len(log.rows))
    return log


def _check_requests(requests: NDArray[np.int32], row_count: int) -> None:
    """Raise if the rows with which the policy's answers begin are not 0 and then ever larger.

    ``[0, 3]`` of five rows is right, ``[1, 3]`` and ``[0, 3, 3]`` are not.

    Args:
        requests: index of the first row of each answer, (k,).
        row_count: number of rows in all.

    Raises:
        ValueError: they are not.
    """
    if requests.ndim != 1 or not np.array_equal(np.unique(requests), requests):
        raise ValueError("the answers of the policy are not in order.")
    if len(requests) and (requests[0] != 0 or requests[-1] > row_count):
        raise ValueError("the answers of the policy do not begin with its rows.")
