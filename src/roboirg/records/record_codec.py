"""Write a record as one line of a records file, and read such lines, whole or as a summary."""

from __future__ import annotations

import functools
import operator
from pathlib import Path
from typing import Any, Generic, TypeVar

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


_TYPES = {field.name: field.type for field in msgspec.structs.fields(Summary)}
_SHARED = ("options", "environment", "ref")
"""Fields that have few values in a run and take long to decode."""
_NAMES = (
    "policy", "task", "split", "arm", "difficulty", "server_version", "language_version", "words",
    "package_version", "code", "verdict_code", "plan", "robot", "render_device",
)  # fmt: skip
"""Fields of text that have few values in a run, together too, and take long to check."""
_read_names = operator.attrgetter(*_NAMES)


class _SharingDecoder(Generic[Stored]):
    """Decodes lines to records; those with the same options or policy share one object for it."""

    def __init__(self, kind: type[Stored]) -> None:
        self._kind = kind
        # Like the kind of record, but with the shared fields as they are in the line, and names
        # unchecked.
        fields: list[Any] = [(name, msgspec.Raw, msgspec.Raw()) for name in _SHARED]
        fields += [(name, str | None, None) for name in _NAMES]
        line = msgspec.defstruct("_Line", fields, bases=(kind,), kw_only=True, gc=False)
        self._decode = msgspec.json.Decoder(line).decode

    def decode(self, line: bytes) -> Stored:
        """Return the record in a line of JSON; raises like the decoders of msgspec.

        Reads the line with the shared fields left undecoded, and decodes each of their texts once;
        the names of a record are checked once for all that have the same.
        If that fails, the plain decoder reads the line, whose error names what is wrong.
        """
        try:
            read = self._decode(line)
            fields = msgspec.structs.asdict(read)
            fields.update(_checked_names(_read_names(read)))
            for name in _SHARED:
                fields[name] = _shared_value(name, bytes(fields[name]))
        except msgspec.MsgspecError:
            # A field is wrong, or a shared one is missing: it may have a default.
            return msgspec.json.decode(line, type=self._kind)
        return self._kind(**fields)


@functools.lru_cache(maxsize=4096)
def _shared_value(name: str, text: bytes) -> object:
    """Return the value of one of the shared fields, decoded from JSON."""
    return msgspec.json.decode(text, type=_TYPES[name])


@functools.lru_cache(maxsize=4096)
def _checked_names(values: tuple[object, ...]) -> dict[str, object]:
    """Return the values of `_NAMES` by field; raises like the decoders of msgspec."""
    names = zip(_NAMES, values, strict=True)
    return {name: msgspec.convert(value, _TYPES[name]) for name, value in names}


_encoder = msgspec.json.Encoder()
_record_decoder = _SharingDecoder(Record)
_summary_decoder = _SharingDecoder(Summary)
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


def _read(decoder: _SharingDecoder[Stored], line: bytes, path: Path, number: int) -> Stored:
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
    """Return (not raise) the error for a line that is JSON, but no record that can be read.

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
