"""What was to be played (`Job`), what came of it (`Result`), and all that is kept (`Record`).

A record is one JSON object. It says everything that the report and the statistics need, so that
they never open the simulator. It depends on its job alone: not on the worker, the order, or what
ran before; `NON_DETERMINISTIC_FIELDS` names the fields that are exempt.
"""

from __future__ import annotations

import hashlib
import re
from typing import Literal, get_args

from pydantic import BaseModel, ConfigDict, JsonValue

from roboirg.core.instruction_options import (
    ALL_STAGES,
    DEFAULT_DISTRACTOR,
    DEFAULT_DISTRACTORS,
    DEFAULT_FRAME,
    InstructionOptions,
)
from roboirg.core.observations import DemonstrationFrames

SCHEMA_VERSION: Literal[2] = 2

Outcome = Literal["success", "failure", "error"]

ErrorKind = Literal[
    "policy", "invalid_action", "timeout", "connection", "environment", "infrastructure"
]
"""Whose fault an error is: the policy raised; its action cannot be executed; it took longer than it
may; its server is not to be reached; the world raised; a process, machine or disk gave way."""

ERROR_KINDS: tuple[ErrorKind, ...] = get_args(ErrorKind)

FailureKind = Literal["grounding", "execution"]

DEFAULT_MAX_STEPS = 1300
DEFAULT_MESHES = "faithful"

NON_DETERMINISTIC_FIELDS = frozenset(
    {
        "attempt",
        "code",
        "details",
        "duration_s",
        "film_lost",
        "plan",
        "spec",
        "started_at",
        "timings",
        "usage",
        "video",
    }
)
"""Times, costs, paths, lost films, tries, code and plan: all that may differ where the same command
is run twice."""


class _RecordModel(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Job(_RecordModel):
    """One episode to play. All fields but `spec` are the identity of its record.

    Attributes:
        policy: its name, which is often its spec.
        task: name of the task.
        split: train, val or test.
        episode: 0-based position in the split.
        setting: explicit, direct, reasoning, contextual or spatial.
        form: implicit or resolved. The explicit setting is its own resolved form and is always
            played as ``implicit``.
        stages: which stages of the discourse are spoken (contextual setting; else all).
        distractor: kind of distractor (contextual setting; else the default).
        distractors: how many of them are spoken (contextual setting; else the default).
        frame: frame of reference (spatial setting; else the default).
        policy_seed: chosen for the run; the policy gets a seed made of it and the episode's.
        max_steps: the policy's limit, control steps.
        actions: the action space that is prescribed, or None for the policy's own.
        demonstration_frames: which pictures of the video are prescribed; None as the policy says.
        observe_every: after how many control steps there is a picture; None as the policy says.
        meshes: faithful or light.
        spec: what makes the policy, where that is not its name: an address may change.
    """

    policy: str
    task: str
    split: str
    episode: int
    setting: str
    form: str = "implicit"
    stages: tuple[int, ...] = ALL_STAGES
    distractor: str = DEFAULT_DISTRACTOR
    distractors: int = DEFAULT_DISTRACTORS
    frame: str = DEFAULT_FRAME
    policy_seed: int = 0
    max_steps: int = DEFAULT_MAX_STEPS
    actions: str | None = None
    demonstration_frames: DemonstrationFrames | None = None
    observe_every: int | None = None
    meshes: str = DEFAULT_MESHES
    spec: str | None = None

    @property
    def options(self) -> InstructionOptions:
        """How the episode is told."""
        return InstructionOptions(
            self.setting, self.form, self.stages, self.distractor, self.distractors, self.frame
        )

    @property
    def policy_spec(self) -> str:
        """What makes the policy: a built-in name, ``package.module:Class``, or an address."""
        return self.spec or self.policy

    @property
    def slug(self) -> str:
        """A short name, unique for the job and good as a file name."""
        words = (self.policy, self.task, self.split, str(self.episode), self.setting, self.form)
        readable = re.sub(r"[^A-Za-z0-9]+", "-", "-".join(words)).strip("-")[:100]
        # Of the fields alone, so that a record (which is a job) has its job's slug.
        identity = repr([(name, getattr(self, name)) for name in IDENTITY])
        return f"{readable}-{hashlib.sha256(identity.encode()).hexdigest()[:8]}"


IDENTITY = tuple(name for name in Job.model_fields if name != "spec")
"""The fields that tell one job from another."""


class UtteranceRecord(_RecordModel):
    """One utterance and its stage in the discourse."""

    stage: str
    text: str


class MentionSpan(_RecordModel):
    """A span of an utterance that introduces a slot value or points back at one.

    Attributes:
        utterance: index of the utterance.
        start: first character of the span.
        end: one past the last.
        role: ``antecedent`` or ``anaphor``.
        expression: class of an anaphor, else None.
        slot: name of the goal slot.
        value: what it stands for.
    """

    utterance: int
    start: int
    end: int
    role: str
    expression: str | None
    slot: str
    value: str | int


class EventRecord(_RecordModel):
    """A fact that became true, or ceased to be, in the world.

    Attributes:
        step: control steps since the policy's turn began; at most 0 in the demonstration.
        kind: as in `roboirg.core.episode.Fact`.
        subject: name of the object.
        place: name of the place, if the kind has one.
        holds: whether it became true.
    """

    step: int
    kind: str
    subject: str
    place: str | None = None
    holds: bool = True


class Attribution(_RecordModel):
    """Why an episode failed, concluded from its events.

    Attributes:
        kind: ``grounding`` (the wrong thing was done) or ``execution`` (the right thing was not
            brought off).
        failure: which of the kind, as in `roboirg.judging.failure_attribution`.
        subject: name of the object that it is about, if there is one.
        step: control step of the policy's turn at which it showed, if there is one.
        sentence: the same in words.
    """

    kind: FailureKind
    failure: str
    subject: str | None = None
    step: int | None = None
    sentence: str


class Result(Job):
    """What came of a job, without what was said and done: all that rates are made of.

    Attributes:
        seed: of the episode's scene.
        difficulty: easy, medium or hard.
        outcome: success, failure (the policy's doing) or error (nobody knows what the policy
            would have done; never counted as a failure).
        error: whose fault an error is; None if it is none.
        cause: why it failed or ended in an error, in words.
        attribution: of a failure; None if nobody can tell.
        steps: control steps that the policy played.
        demonstration_steps: frames, one per control step, of the video that was shown before;
            0 without one.
        privileged: whether the policy looks behind the scenes (it has ``attach``).
        policy_version: tells a policy from an earlier one of the same name.
        language_version: version of the instruction generator.
        environment_version: version of scenes, rules and physics.
        package_version: version of roboirg.
        code: fingerprint of the package's files.
        plan: fingerprint of the plan in whose course it was played.
        attempt: 1 for the first try.
    """

    seed: int
    difficulty: str
    outcome: Outcome
    error: ErrorKind | None = None
    cause: str | None = None
    attribution: Attribution | None = None
    steps: int = 0
    demonstration_steps: int = 0
    privileged: bool
    policy_version: str = "unknown"
    language_version: str
    environment_version: int
    package_version: str
    code: str = "unknown"
    plan: str | None = None
    attempt: int = 1

    @property
    def identity(self) -> Job:
        """The job this is the result of, whatever made the policy."""
        return Job(**{name: getattr(self, name) for name in IDENTITY})


class Record(Result):
    """All that is kept of an episode.

    Attributes:
        schema_version: of this table of fields.
        instruction: the utterances that the policy was given.
        mentions: the referring expressions in them.
        command: the same task in plain words (the explicit setting).
        goal: what the instruction conveys, a value for each slot.
        metadata: of the instruction: reasoning pattern, relation, stages, landmarks, template
            ids and the like.
        policy_metadata: what the policy says of itself: checkpoint, server, model, …
        events: what happened, in order.
        usage: what the episode cost: ``calls``, ``input_tokens``, ``output_tokens``, ``cost_usd``
            of models that the policy asked.
        timings: wall-clock seconds by phase: ``policy_load``, ``policy_reset``, ``policy_act``,
            ``env_reset``, ``env_step``, ….
        video: path relative to the records file, or None.
        film_lost: why the film that was asked for could not be written, or None.
        details: the traceback of an error, or None.
        render_device: the driver's name of the device that drew the pictures, or None.
        started_at: ISO 8601, UTC.
        duration_s: wall-clock seconds.
    """

    schema_version: Literal[2] = SCHEMA_VERSION
    instruction: tuple[UtteranceRecord, ...]
    mentions: tuple[MentionSpan, ...] = ()
    command: str
    goal: dict[str, str | int | tuple[str, ...] | tuple[int, ...]]
    metadata: dict[str, JsonValue]
    policy_metadata: dict[str, JsonValue] = {}
    events: tuple[EventRecord, ...] = ()
    usage: dict[str, float] = {}
    timings: dict[str, float] = {}
    video: str | None = None
    film_lost: str | None = None
    details: str | None = None
    render_device: str | None = None
    started_at: str
    duration_s: float

    def comparable(self) -> dict[str, object]:
        """All fields that depend on the job alone: everything but `NON_DETERMINISTIC_FIELDS`."""
        return self.model_dump(mode="json", exclude=set(NON_DETERMINISTIC_FIELDS))
