"""One line of a records file: what of it is needed, and older schemas."""

from __future__ import annotations

import json
import operator
from pathlib import Path
from typing import Any, TypeVar

import msgspec
from pydantic import ValidationError

from roboirg.core.errors import RoboIRGError
from roboirg.core.instruction_options import (
    ALL_STAGES,
    DEFAULT_DISTRACTOR,
    DEFAULT_DISTRACTORS,
    DEFAULT_FRAME,
)
from roboirg.records.record import (
    DEFAULT_MAX_STEPS,
    DEFAULT_MESHES,
    IDENTITY,
    SCHEMA_VERSION,
    ErrorKind,
    Job,
    Result,
)

OLDEST_SCHEMA = 1

ResultType = TypeVar("ResultType", bound=Result)


class StoreError(RoboIRGError):
    """The records cannot be read or written; the sentence says which and why."""


class DamagedLineError(StoreError):
    """A line is not JSON: cut short, or overwritten."""


class RecordIndexEntry(msgspec.Struct, frozen=True, gc=False):
    """The identity of a record, how it ended, and what it must not be mixed with.

    The first fields are those of a `Job`. Read instead of whole records where there are very many
    of them: in a tenth of the time and memory.
    """

    policy: str
    task: str
    split: str
    episode: int
    setting: str
    schema_version: int
    seed: int
    outcome: str
    language_version: str
    environment_version: int
    form: str = "implicit"
    stages: tuple[int, ...] = ALL_STAGES
    distractor: str = DEFAULT_DISTRACTOR
    distractors: int = DEFAULT_DISTRACTORS
    frame: str = DEFAULT_FRAME
    policy_seed: int = 0
    max_steps: int = DEFAULT_MAX_STEPS
    actions: str | None = None
    demonstration_frames: int | str | None = None
    observe_every: int | None = None
    meshes: str = DEFAULT_MESHES
    policy_version: str = "unknown"
    cause: str | None = None
    attempt: int = 1
    duration_s: float = 0.0


class _Version(msgspec.Struct):
    schema_version: int


RecordKey = tuple[object, ...]
"""A job's identity: the values of its fields."""

_identity = operator.attrgetter(*IDENTITY)
_decoder = msgspec.json.Decoder(RecordIndexEntry)
_version_decoder = msgspec.json.Decoder(_Version)


def identity_key(one: Job | RecordIndexEntry) -> RecordKey:
    """The identity of a job, a record, or what is read of one."""
    key: RecordKey = _identity(one)
    return key


def read_index_entry(line: bytes, path: Path, number: int) -> RecordIndexEntry:
    """What the runner has to know of a line.

    Args:
        line: without its newline.
        path: of the file, for the error.
        number: of the line, from 1.

    Raises:
        DamagedLineError: it is not JSON.
        StoreError: it is not a record of a version that can be read.
    """
    try:
        stored = _decoder.decode(line)
    except msgspec.ValidationError:
        read_line(line, path, number, Result)  # knows what is wrong with it
        raise StoreError(f"{path} line {number} is not a record.") from None
    except msgspec.DecodeError as error:
        raise _damaged(path, number, error) from error
    _check_schema(stored.schema_version, path, number)
    return stored


def read_line(line: bytes, path: Path, number: int, kind: type[ResultType]) -> ResultType:
    """A line as a whole record, or as its result alone.

    Raises:
        DamagedLineError: it is not JSON.
        StoreError: it is not a record of a version that can be read.
    """
    try:
        version = _version_decoder.decode(line).schema_version
    except msgspec.ValidationError:
        version = None
    except msgspec.DecodeError as error:
        raise _damaged(path, number, error) from error
    _check_schema(version, path, number)
    if version != SCHEMA_VERSION:
        line = json.dumps(_upgraded(json.loads(line))).encode()
    try:
        return kind.model_validate_json(line, extra="ignore" if kind is Result else "forbid")
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise StoreError(
            f"{path} line {number} is not a record: {place}: {first['msg']}."
        ) from error


def _damaged(path: Path, number: int, error: Exception) -> DamagedLineError:
    return DamagedLineError(f"{path} line {number} is damaged: it is not JSON ({error}).")


def _check_schema(version: object, path: Path, number: int) -> None:
    if type(version) is not int or not OLDEST_SCHEMA <= version <= SCHEMA_VERSION:
        raise StoreError(
            f"{path} line {number} has schema version {version!r}, but this roboirg reads versions "
            f"{OLDEST_SCHEMA} to {SCHEMA_VERSION}; use the roboirg that wrote it, or another "
            "folder."
        )


def _upgraded(data: dict[str, Any]) -> dict[str, Any]:
    """What was written in an older schema, in today's."""
    if data["schema_version"] == 1:
        data = {**data, "schema_version": 2, "error": _error_kind(data)}
    return data


def _error_kind(data: dict[str, Any]) -> ErrorKind | None:
    """Schema 1 named whose fault an error was in its cause alone."""
    if data.get("outcome") != "error":
        return None
    blamed = str(data.get("cause")).partition(":")[0]
    if blamed == "policy":
        return "policy"
    if blamed == "invalid action":
        return "invalid_action"
    return "infrastructure" if "worker died" in str(data.get("cause")) else "environment"
