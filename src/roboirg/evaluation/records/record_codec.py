"""Read one line of a records file: as a record, a summary, or an index entry."""

from __future__ import annotations

import operator
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec
from pydantic import ValidationError

from roboirg.core.delivery import PromptVerdict
from roboirg.core.errors import RoboIRGError
from roboirg.core.instruction_options import (
    ALL_STAGES,
    DEFAULT_DELIVERY,
    DEFAULT_DISTRACTOR,
    DEFAULT_DISTRACTORS,
    DEFAULT_FRAME,
    DEFAULT_REASONING,
    DEFAULT_RIVAL,
    InstructionOptions,
)
from roboirg.core.observations import DemonstrationFrames, DemonstrationSource
from roboirg.evaluation.records.record import (
    DEFAULT_MAX_STEPS,
    DEFAULT_MESHES,
    IDENTITY,
    NAME,
    SCHEMA_VERSION,
    ErrorKind,
    FailureKind,
    Job,
    Outcome,
    Record,
    Result,
    options_of,
    real_robot,
    slug_of,
)
from roboirg.evaluation.records.run_files import RELATIVE_PATH

Name = Annotated[str, msgspec.Meta(pattern=NAME)]
RunPath = Annotated[str, msgspec.Meta(pattern=RELATIVE_PATH)]

EntryType = TypeVar("EntryType", bound="RecordIndexEntry")


class StoreError(RoboIRGError):
    """The records cannot be read or written; the message names the file and the reason."""


class DamagedLineError(StoreError):
    """A line is not valid JSON: cut short or overwritten."""


class RecordIndexEntry(msgspec.Struct, frozen=True, gc=False):
    """Identity, outcome and versions of a record, with the attributes of a `Record`.

    Read instead of whole records to save time and memory: it takes a tenth of both.
    """

    policy: Name
    task: Name
    split: Name
    episode: int
    setting: Name
    schema_version: int
    seed: int
    outcome: str
    language_version: str
    environment_version: int
    form: Name = "implicit"
    stages: tuple[int, ...] = ALL_STAGES
    distractor: Name = DEFAULT_DISTRACTOR
    distractors: int = DEFAULT_DISTRACTORS
    frame: Name = DEFAULT_FRAME
    delivery: Name = DEFAULT_DELIVERY
    rival: Name = DEFAULT_RIVAL
    reasoning: Name = DEFAULT_REASONING
    policy_seed: int = 0
    max_steps: int = DEFAULT_MAX_STEPS
    actions: Name | None = None
    demonstration_frames: int | str | None = None
    observe_every: int | None = None
    meshes: Name = DEFAULT_MESHES
    wordings: Name | None = None
    policy_version: Name = "unknown"
    server_version: Name | None = None
    cause: str | None = None
    attempt: int = 1
    duration_s: float = 0.0

    @property
    def options(self) -> InstructionOptions:
        """The instruction options, as of its `Job`."""
        return options_of(self)

    @property
    def identity(self) -> Job:
        """Its job, without the policy's spec."""
        return Job(**{name: getattr(self, name) for name in IDENTITY})

    @property
    def slug(self) -> str:
        """The slug of its `Job`."""
        return slug_of({name: getattr(self, name) for name in IDENTITY})


class StoredAttribution(msgspec.Struct, frozen=True, gc=False):
    """An `Attribution`."""

    kind: FailureKind
    failure: str
    sentence: str
    subject: str | None = None
    step: int | None = None


class StoredPolicyMetadata(msgspec.Struct, frozen=True, gc=False):
    """What says where a record was played; the rest is not decoded.

    It may be anything, because policies report metadata.
    """

    real_trial: Any = None


class EpisodeSummary(RecordIndexEntry, frozen=True, kw_only=True):
    """All attributes of a `Result`, and what the head of a page shows."""

    difficulty: str
    outcome: Outcome
    error: ErrorKind | None = None
    attribution: StoredAttribution | None = None
    steps: int = 0
    demonstration_steps: int = 0
    demonstration_source: DemonstrationSource = "none"
    privileged: bool
    package_version: str
    code: str = "unknown"
    plan: str | None = None
    spec: str | None = None
    wordings_file: str | None = None
    demonstration_frames: DemonstrationFrames | None = None
    prompt_verdict: PromptVerdict = "unknown"
    started_at: str
    render_device: str | None = None
    video: RunPath | None = None
    policy_metadata: StoredPolicyMetadata = StoredPolicyMetadata()

    @property
    def robot(self) -> str | None:
        """The real robot, as of its `Record`."""
        return real_robot(self.policy_metadata.real_trial)


AnyResult = Result | EpisodeSummary
"""A verdict with everything that rates are computed from."""


class StoredMention(msgspec.Struct, frozen=True, gc=False):
    """The utterance of a mention, and its class if it is an anaphor."""

    utterance: int
    expression: str | None = None


class StoredInstruction(RecordIndexEntry, frozen=True):
    """An index entry with what tells kinds of instructions apart: metadata and mentions.

    The utterances are not decoded.
    """

    instruction: tuple[msgspec.Raw, ...] = ()
    metadata: dict[str, Any] = {}
    mentions: tuple[StoredMention, ...] = ()


class _Version(msgspec.Struct):
    schema_version: int


RecordKey = tuple[object, ...]
"""Identity of a job: the values of its fields in `IDENTITY`."""

_identity = operator.attrgetter(*IDENTITY)
_decoder = msgspec.json.Decoder(RecordIndexEntry)
_summary_decoder = msgspec.json.Decoder(EpisodeSummary)
_instruction_decoder = msgspec.json.Decoder(StoredInstruction)
_version_decoder = msgspec.json.Decoder(_Version)


def identity_key(one: Job | RecordIndexEntry) -> RecordKey:
    """Return the identity of a job, a record or an index entry."""
    key: RecordKey = _identity(one)
    return key


def read_index_entry(line: bytes, path: Path, number: int) -> RecordIndexEntry:
    """Read a line as an index entry.

    Args:
        line: without its newline.
        path: of the file, for the error.
        number: of the line, from 1.

    Raises:
        DamagedLineError: the line is not JSON.
        StoreError: the line is not a record of this schema version.
    """
    return _read_struct(_decoder, line, path, number)


def read_summary(line: bytes, path: Path, number: int) -> EpisodeSummary:
    """Read a line as a summary.

    Raises:
        DamagedLineError: the line is not JSON.
        StoreError: the line is not a record of this schema version.
    """
    return _read_struct(_summary_decoder, line, path, number)


def read_instruction(line: bytes, path: Path, number: int) -> StoredInstruction:
    """Read a line as an index entry with what tells kinds of instructions apart.

    Raises:
        DamagedLineError: the line is not JSON.
        StoreError: the line is not a record of this schema version.
    """
    return _read_struct(_instruction_decoder, line, path, number)


def _read_struct(
    decoder: msgspec.json.Decoder[EntryType], line: bytes, path: Path, number: int
) -> EntryType:
    try:
        stored = decoder.decode(line)
    except msgspec.ValidationError:
        read_line(line, path, number)  # raises with the exact reason
        raise StoreError(f"{path} line {number} is not a record.") from None
    except msgspec.DecodeError as error:
        raise _damaged(path, number, error) from error
    _check_schema(stored.schema_version, path, number)
    return stored


def read_line(line: bytes, path: Path, number: int) -> Record:
    """Read a line as a `Record`.

    Raises:
        DamagedLineError: the line is not JSON.
        StoreError: the line is not a record of this schema version.
    """
    try:
        version = _version_decoder.decode(line).schema_version
    except msgspec.ValidationError:
        version = None
    except msgspec.DecodeError as error:
        raise _damaged(path, number, error) from error
    _check_schema(version, path, number)
    try:
        return Record.model_validate_json(line)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise StoreError(
            f"{path} line {number} is not a record: {place}: {first['msg']}."
        ) from error


def _damaged(path: Path, number: int, error: Exception) -> DamagedLineError:
    return DamagedLineError(f"{path} line {number} is damaged: it is not JSON ({error}).")


def _check_schema(version: object, path: Path, number: int) -> None:
    if version != SCHEMA_VERSION:
        raise StoreError(
            f"{path} line {number} has schema version {version!r}, but this roboirg reads only "
            f"version {SCHEMA_VERSION}; use the roboirg that wrote it, or another folder."
        )
