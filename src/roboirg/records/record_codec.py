"""Write a record as one line of a records file, and read such lines, whole or as a summary."""

from __future__ import annotations

import operator
from pathlib import Path
from typing import TypeVar

import msgspec

from roboirg.core.errors import RoboIRGError
from roboirg.core.field_types import LABEL, LABEL_RULE, MOST_NAME_LETTERS, NAME
from roboirg.records.record import IDENTITY, SCHEMA_VERSION, Record, Summary
from roboirg.records.run_files import RELATIVE_PATH

Stored = TypeVar("Stored", bound=Summary)

RecordKey = tuple[object, ...]
"""Identity of a job: the values of its fields in `IDENTITY`."""


class StoreError(RoboIRGError):
    """The records cannot be read or written; the message names the file and the reason."""


class DamagedLineError(StoreError):
    """A line is not valid JSON: cut short or overwritten."""


_MEANINGS = {
    LABEL: f"of {LABEL_RULE}",
    NAME: f"of at most {MOST_NAME_LETTERS:,} characters, without control characters",
    RELATIVE_PATH: "that is a path below the run's folder, in letters, digits, '_', '.' and '-'",
}
"""The regular expressions of fields, and what they mean."""


class _Version(msgspec.Struct):
    """What of a line is read to explain why the rest cannot be."""

    schema_version: int


_encoder = msgspec.json.Encoder()
_record_decoder = msgspec.json.Decoder(Record)
_summary_decoder = msgspec.json.Decoder(Summary)
_version_decoder = msgspec.json.Decoder(_Version)
identity_key: operator.attrgetter[RecordKey] = operator.attrgetter(*IDENTITY)
"""Returns the identity of a job, a summary or a record."""


def encode(record: Record) -> bytes:
    """Return a record as a line, without its newline."""
    return _encoder.encode(record)


def read_record(line: bytes, path: Path, number: int) -> Record:
    """Read a line as a whole record.

    Args:
        line: without its newline.
        path: of the file, for the error.
        number: of the line, from 1.

    Raises:
        DamagedLineError: the line is not JSON.
        StoreError: the line is not a record of a schema version that can be read.
    """
    return _read(_record_decoder, line, path, number)


def read_summary(line: bytes, path: Path, number: int) -> Summary:
    """Read a line as a summary.

    Raises:
        DamagedLineError: the line is not JSON.
        StoreError: the line is not a record of a schema version that can be read.
    """
    return _read(_summary_decoder, line, path, number)


def _read(decoder: msgspec.json.Decoder[Stored], line: bytes, path: Path, number: int) -> Stored:
    """Return the record or summary in a line of JSON; raises like `read_record`.

    Args:
        decoder: of records or of summaries.
        line: without its newline.
        path: of the file, for the error.
        number: of the line, from 1, for the error.
    """
    try:
        stored = decoder.decode(line)
    except msgspec.ValidationError as error:
        raise _schema_error(line, path, number, error) from error
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise DamagedLineError(
            f"{path} line {number} is damaged: it is not JSON ({error})."
        ) from error
    if stored.outcome == "success" and stored.cause is not None:
        problem = f"a success has no cause, but there is {stored.cause!r}"
        raise StoreError(f"{path} line {number} is not a record: {problem}.")
    return stored


def _schema_error(
    line: bytes, path: Path, number: int, error: msgspec.ValidationError
) -> StoreError:
    """Return the error to raise for a line that is JSON, but no record that can be read.

    It names the schema version of the line if that is another one, else the field that is wrong.

    Args:
        line: without its newline.
        path: of the file.
        number: of the line, from 1.
        error: what msgspec raised.
    """
    try:
        version = _version_decoder.decode(line).schema_version
    except msgspec.ValidationError:
        version = None
    if version == SCHEMA_VERSION:
        return StoreError(f"{path} line {number} is not a record: {_plain_complaint(error)}.")
    return StoreError(
        f"{path} line {number} has schema version {version!r}, but this roboirg reads only version "
        f"{SCHEMA_VERSION}; use the roboirg that wrote it, or another folder."
    )


def _plain_complaint(error: Exception) -> str:
    """Return msgspec's complaint about a record in plain words.

    ``matching regex '...'`` becomes what the regular expression means.
    """
    words = str(error)
    for pattern, meaning in _MEANINGS.items():
        words = words.replace(f"matching regex {pattern!r}", meaning)
    return words
