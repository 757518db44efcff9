"""Data of one episode: what to play (`Job`), how it went (`Summary`), and everything (`Record`).

A record is one JSON object with everything that reports and statistics need, so they never start
the simulator. It depends only on its job, not on the worker, the order, or what ran before, except
for the fields in `NON_DETERMINISTIC_FIELDS`.

These structs are the one list of fields: identity and keys derive from them.
Types are checked when a line is read, and every line is read before it is stored.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Annotated, Any, Literal, Self, get_args

import msgspec

from roboirg.core.arms import TOLD
from roboirg.core.delivery import PromptVerdict
from roboirg.core.environment_options import EnvironmentOptions
from roboirg.core.failures import FailureKind
from roboirg.core.field_types import MOST_CAUSE_LETTERS, Cause, Label, Name, Subgoal, Whole
from roboirg.core.inference_facts import InferenceFacts
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.observations import DemonstrationSource
from roboirg.core.plain_text import clip_text
from roboirg.core.policy_ref import PolicyRef
from roboirg.core.versions import NO_VERSION, Versions
from roboirg.core.word_pools import PoolName, outside_words, pool_of
from roboirg.records.run_files import RELATIVE_PATH
from roboirg.util.short_hash import short_hash

SCHEMA_VERSION: Literal[1] = 1
_MOST_SLUG_LETTERS = 100
"""Of the part of a slug that can be read; a hash follows."""

RunPath = Annotated[str, msgspec.Meta(pattern=RELATIVE_PATH)]
Outcome = Literal["success", "failure", "error"]

ErrorKind = Literal[
    "policy", "invalid_action", "timeout", "connection", "environment", "infrastructure", "prompt"
]
"""What an error is due to: the policy raised; its action cannot be executed; a time limit was
exceeded; a server could not be reached; the environment raised; a process or machine was lost; the
instruction is longer than what the policy's model reads, and such episodes were not to be played.
"""

ERROR_KINDS: tuple[ErrorKind, ...] = get_args(ErrorKind)

OriginalStatus = Literal["success", "failure", "undecided"]

NON_DETERMINISTIC_FIELDS = frozenset(
    {
        "attempt",
        "code",
        "details",
        "duration_s",
        "inference",
        "plan",
        "processor",
        "ref",
        "started_at",
        "timings",
        "usage",
        "verdict_code",
        "video",
        "video_error",
        "wordings_file",
    }
)
"""Fields that may differ when the same command runs twice: times, costs, paths, attempts, …"""


class Job(msgspec.Struct, frozen=True, kw_only=True, gc=False):
    """One episode to play. All fields but `ref` and `wordings_file` identify its record.

    Attributes:
        policy: name of the policy.
        task: name of the task.
        split: train, val, test or random.
        episode: 0-based position in the split.
        options: of its instruction; those that the setting does not read have their defaults. The
            explicit setting is its own resolved form and is always played as ``implicit``.
        policy_seed: seed chosen for the run; the policy's seed is derived from it and the episode.
        environment: how the episode is played.
        arm: which control arm it is, as in `roboirg.core.arms`; ``told`` for the episode's words.
        wordings_file: path of the wording file in `options`; not part of the identity, because a
            file may be moved.
        ref: the policy; not part of the identity, because an address may change. None where no
            policy plays.
    """

    policy: Label
    task: Label
    split: Label
    episode: Whole
    options: InstructionOptions
    policy_seed: Whole = 0
    environment: EnvironmentOptions = EnvironmentOptions()
    arm: Label = TOLD
    wordings_file: str | None = None
    ref: PolicyRef | None = None

    @property
    def pool(self) -> PoolName:
        """The pool that its words are taken from."""
        return pool_of(self.split, self.options.wordings)

    @property
    def setting(self) -> str:
        """The setting of the instruction, such as ``direct``."""
        return self.options.setting

    @property
    def form(self) -> str:
        """The form of the instruction: ``implicit`` or ``resolved``."""
        return self.options.form

    @property
    def column(self) -> InstructionOptions:
        """The options without `wordings`: the columns of tables.

        Wordings tell runs apart, as a step limit does: the columns are the same in all.
        """
        if self.options.wordings is None:
            return self.options
        return replace(self.options, wordings=None)

    def with_options(self, **changes: Any) -> Self:  # noqa: ANN401 - as the options' fields
        """Return the same job in other words."""
        return msgspec.structs.replace(self, options=replace(self.options, **changes))

    @property
    def slug(self) -> str:
        """Name for the files of an episode: ``mine-PickXtimes-test-0-direct-implicit-1a2b3c``.

        It ends in a hash of all fields that identify the job, as the readable part may be cut.
        """
        words = [self.policy, self.task, self.split, str(self.episode), self.setting, self.form]
        # A record is a job with more fields; only those of the job count, so both have one slug.
        identity = {name: getattr(self, name) for name in IDENTITY}
        if self.arm == TOLD:
            del identity["arm"]  # files of runs without arms keep their names
        else:
            words.append(self.arm)
        readable = re.sub(r"[^A-Za-z0-9]+", "-", "-".join(words)).strip("-")
        unique = short_hash(msgspec.json.encode(identity))
        return f"{readable[:_MOST_SLUG_LETTERS]}-{unique}"


IDENTITY = tuple(name for name in Job.__struct_fields__ if name not in {"ref", "wordings_file"})
"""The fields that identify a job."""


class UtteranceRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One utterance and its stage in the discourse.

    Attributes:
        stage: its part in the discourse.
        text: its words.
        step: control step of the policy's turn at which it was heard; 0 is before its first step,
            and after the video if there is one; None if the episode ended before.
    """

    stage: str
    text: str
    step: Whole | None = 0


class MentionSpan(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A span of an utterance that introduces a slot value or refers back to one.

    Attributes:
        utterance: index of the utterance.
        start: first character of the span.
        end: one past the last.
        role: ``antecedent`` or ``anaphor``.
        expression: class of an anaphor; None for an antecedent.
        slot: name of the goal slot.
        value: value of the slot.
    """

    utterance: Whole
    start: Whole
    end: Whole
    role: str
    expression: str | None
    slot: str
    value: str | int


class EventRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A fact that became true or false during the episode.

    Attributes:
        step: control steps since the policy's turn began; at most 0 in the demonstration.
        kind: as in `roboirg.core.episode.Fact`.
        subject: name of the object.
        place: name of the place, if the kind has one.
        holds: whether it became true; otherwise it became false.
    """

    step: Whole
    kind: str
    subject: str
    place: str | None = None
    holds: bool = True


class SubgoalRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A subgoal that a planner named, when it or the due stage was new.

    Attributes:
        step: control steps of the policy before it.
        text: as the planner said it.
        point: row and column in the front picture, if it has them.
        due: the stage that was due, in words; None after the last one.
        verdict: whether it is what was due, as in `roboirg.judging.subgoal_verdicts`.
        ended: how it ended, as in `roboirg.policies.contract.base.SubgoalEnd`; None if the policy
            reports no ends, or the episode ended first.
        why: why it was not done.
        thing: name of the object that the hands took it to mean; a point outweighs words.
    """

    step: Whole
    text: Subgoal
    point: tuple[Whole, Whole] | None = None
    due: Name | None = None
    verdict: Name
    ended: Name | None = None
    why: Cause | None = None
    thing: Name | None = None


class Attribution(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Why an episode failed, concluded from what was declared, its events and its attempts.

    Attributes:
        kind: as in `roboirg.core.failures.FAILURE_KINDS`.
        failure: its name, as in `roboirg.core.failures.FAILURES`.
        subject: name of the object concerned, if there is one.
        step: control step of the policy's turn at which the failure showed, if there is one.
        sentence: explanation in words.
    """

    kind: FailureKind
    failure: str
    subject: str | None = None
    step: Whole | None = None
    sentence: str


class GoalOutcomes(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Which goals of the scene the trajectory reached; goals have names such as `color red`.

    Attributes:
        stated: the goal that the verdict is about.
        reached: all goals whose stages were completed, those on the way to another included.
        agrees: those that are still possible after the first wrong act, or are reached by it; empty
            unless something forbidden decided the verdict.
        original: whether the scene's own goal was reached, where the words state another one; None
            in the other arms.
    """

    stated: Name
    reached: tuple[Name, ...] = ()
    agrees: tuple[Name, ...] = ()
    original: OriginalStatus | None = None


class PromptAudit(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What of the instruction reached the policy's language model, by the limit it declares.

    Attributes:
        limit: tokens that the model reads of a message.
        needed: tokens that the longest message needs, at least and at most.
        tokenizer: name of the file of the tokenizer that counted; None for bounds without one.
        reached: for each utterance, the characters from its beginning that can have arrived; an
            utterance that was not said yet is not counted here.
        lost: indices of the mentions that certainly did not arrive whole.
    """

    limit: Whole
    needed: tuple[Whole, Whole]
    tokenizer: str | None = None
    reached: tuple[Whole, ...]
    lost: tuple[Whole, ...] = ()

    @property
    def needed_text(self) -> str:
        """How many tokens are needed, between two bounds if they differ."""
        low, high = self.needed
        return f"{low}" if low == high else f"{low} to {high}"


# Checkers see no use in a struct of which a part is frozen: what was played, not how it went.
class Summary(Job, frozen=False, kw_only=True, gc=False):  # type: ignore[misc]
    """How a job went, without instruction and events: everything that rates are computed from.

    Read instead of whole records to save time and memory.

    Attributes:
        schema_version: version of the list of a record's fields.
        seed: seed of the episode's scene.
        difficulty: easy, medium or hard.
        outcome: success, failure (due to the policy) or error (the episode could not be judged;
            never counted as a failure).
        error: kind of error; None if the outcome is not an error.
        cause: why it failed or ended in an error, in words.
        attribution: of a failure; None if the reason is unclear.
        goals: which goals of the scene were reached; None for an error.
        steps: control steps that the policy played.
        demonstration_steps: frames of the video before the policy's turn, one per control step;
            0 without a video.
        demonstration_source: whose actions the video shows: RoboMME's (``recorded``), the oracle's
            (``planned``), or ``none``.
        ref: the policy as it played, with the version that it declared then.
        server_version: that the policy's server reported; None if there is no server, if it
            reported none, or if the episode ended before.
        language_version: version of the instruction generator.
        words: which words of the task and pool were said, such as ``PickXtimes/test@1a2b3c4d5e6f``.
        environment_version: version of scenes, rules and physics.
        package_version: version of roboirg.
        code: fingerprint of the package's files.
        verdict_code: fingerprint of those that can change a verdict; None in earlier records.
        plan: fingerprint of the plan.
        attempt: number of the attempt, from 1.
        prompt_verdict: whether all that was said reached the policy's language model.
        guessed: whether the policy reports that it chose a goal at random, because the words have
            no meaning for it.
        usage: what models queried by the policy cost: ``calls``, ``input_tokens``,
            ``output_tokens``, ``cost_usd``; those that are unknown are missing.
        robot: the real robot that played it; None in simulation.
        action_log: digest of the executed actions, as in `roboirg.records.action_log`;
            None if they were not kept.
        video: path of the video relative to the records file, or None.
        render_device: the driver's name of the render device; None if nothing was rendered.
        processor: architecture, maker and family of the processor that simulated it, which decide
            the last bits of the record's `end_state`; None if it is not known.
        started_at: ISO 8601, UTC.
        duration_s: wall-clock seconds.
    """

    schema_version: Literal[1] = SCHEMA_VERSION
    seed: Whole
    difficulty: Label
    outcome: Outcome
    error: ErrorKind | None = None
    cause: Cause | None = None
    attribution: Attribution | None = None
    goals: GoalOutcomes | None = None
    steps: Whole = 0
    demonstration_steps: Whole = 0
    demonstration_source: DemonstrationSource = "none"
    ref: PolicyRef
    server_version: Name | None = None
    language_version: Name
    words: Name
    environment_version: Whole
    package_version: Name
    code: Name = "unknown"
    verdict_code: Name | None = None
    plan: Name | None = None
    attempt: Whole = 1
    prompt_verdict: PromptVerdict = "unknown"
    guessed: bool = False
    usage: dict[str, float] = {}
    robot: Name | None = None
    action_log: str | None = None
    video: RunPath | None = None
    render_device: Name | None = None
    processor: str | None = None
    started_at: Name
    duration_s: float

    @property
    def privileged(self) -> bool:
        """Whether the policy had access to the simulator's state."""
        return self.ref.is_privileged

    @property
    def policy_version(self) -> str:
        """Distinguishes versions of a policy of the same name."""
        return self.ref.version

    @property
    def played_version(self) -> str:
        """The version of the policy with that of its server, if it reported one."""
        if self.server_version is None:
            return self.policy_version
        return f"{self.policy_version} (server {self.server_version})"

    @property
    def policy_versions(self) -> Versions:
        """Versions of the policy and its server, for comparisons.

        The server's version is None if it is not known, as an error may have come before it.
        """
        missing = None if self.outcome == "error" else NO_VERSION
        return self.ref.versions._replace(server_version=self.server_version or missing)

    @property
    def words_owner(self) -> str:
        """Which texts the words are from; results with the same owner must not mix versions.

        ``words`` has the owner, and after the ``@`` a digest of the texts, which is their version:

        ==================================  ===================================
        ``words``                           owner
        ==================================  ===================================
        ``PickXtimes/test@1a2b…``           ``PickXtimes/test``: task and pool
        ``PickXtimes/test/grounded@3c4d…``  ``PickXtimes/test/grounded``: a setting has its own
        any, with a wording file *mine*     ``PickXtimes/test of mine@5e6f…``
        ==================================  ===================================
        """
        usual = f"{self.task}/{self.pool}"
        owner, _, _ = self.words.partition("@")
        if not owner.startswith(f"{usual}/"):
            owner = usual  # as the words of a wording file have an identity of another form
        wordings = outside_words(self.options.wordings)
        if wordings is None:
            return owner
        return f"{owner} of {wordings}"

    @property
    def identity(self) -> Job:
        """Its job, without the policy."""
        return Job(**{name: getattr(self, name) for name in IDENTITY})


class Record(Summary, kw_only=True, forbid_unknown_fields=True):  # type: ignore[misc]
    """Everything that is stored of an episode; filled in while it is played, and stored once.

    So an error keeps what came before.

    Attributes:
        instruction: the utterances that the policy was given.
        mentions: the referring expressions in them.
        prompt: what of them reached its language model; None if the policy declares no limit.
        command: the same task in the explicit setting.
        goal: what the instruction conveys, a value for each slot.
        metadata: of the instruction: reasoning pattern, relation, stages, landmarks, ….
        policy_metadata: what the policy reports about itself: checkpoint, server, model, ….
        needs: what it declares that it needs, or the job prescribes instead, as in `PolicyNeeds`.
        calls: how often it was asked for actions.
        executed: the most actions of one answer that were executed; a server may send fewer than
            its client's option ``execute`` allows.
        inference: what its process computes with; None if it was not asked.
        end_state: hash of the state in which the episode left the world and the judge; None if it
            did not come to an end.
        events: facts that became true or false, in order.
        attempts: the same for facts of attempts, which no stage expects; None if they were not
            watched for, as with a real robot.
        subgoals: what a planner named, in order.
        timings: wall-clock seconds by phase: ``policy_load``, ``policy_act``, ``env_step``, ….
        video_error: why the requested video could not be written, or None.
        details: traceback of an error, or None.
    """

    instruction: tuple[UtteranceRecord, ...]
    mentions: tuple[MentionSpan, ...] = ()
    prompt: PromptAudit | None = None
    command: str
    goal: dict[str, str | int | tuple[str | int, ...]]
    metadata: dict[str, Any]
    policy_metadata: dict[str, Any] = {}
    needs: dict[str, Any] = {}
    calls: Whole = 0
    executed: Whole = 0
    inference: InferenceFacts | None = None
    end_state: str | None = None
    events: tuple[EventRecord, ...] = ()
    attempts: tuple[EventRecord, ...] | None = None
    subgoals: tuple[SubgoalRecord, ...] = ()
    timings: dict[str, float] = {}
    video_error: str | None = None
    details: str | None = None

    def record_error(self, kind: ErrorKind, cause: str, details: str | None = None) -> None:
        """Set the outcome to an error, as the episode cannot be judged, and clear its verdict.

        Args:
            kind: of the error.
            cause: in words; cut if it is too long.
            details: traceback, if there is one.
        """
        self.outcome = "error"
        self.error = kind
        self.cause = clip_text(cause, MOST_CAUSE_LETTERS)
        self.details = details
        self.goals = None
        self.attribution = None

    def record_status(self, status: str, cause: str | None) -> bool:
        """Set outcome and cause from the status of the environment; return whether it was final.

        ``"timeout"`` is a failure; ``"ongoing"`` changes nothing and returns False.

        Args:
            status: as the environment reports it.
            cause: of a failure, if the environment gives one.
        """
        if status not in ("success", "failure", "timeout"):
            return False
        self.error = None
        if status == "success":
            self.outcome = "success"
            self.cause = None
            return True
        if not cause:
            cause = "the judge gave no cause"
            if status == "timeout":
                cause = f"not done after {self.environment.max_steps} steps"
        self.outcome = "failure"
        self.cause = clip_text(cause, MOST_CAUSE_LETTERS)
        return True
