"""The result of one rollout, and the record made from it."""

from __future__ import annotations

import datetime as dt
import functools
import hashlib
import importlib.metadata
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue

from roboirg import language
from roboirg.core.actions import CHOICE, find_action_space
from roboirg.core.arms import TOLD
from roboirg.core.delivery import TURNS, PromptVerdict
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.core.field_types import MOST_CAUSE_LETTERS
from roboirg.core.inference_facts import InferenceFacts
from roboirg.core.observations import DemonstrationSource
from roboirg.core.plain_text import clip_text
from roboirg.evaluation.hosting.policy_descriptions import PolicyDescription, describe_policy
from roboirg.evaluation.play.goal_outcomes import find_goal_outcomes, judged_events, name_other_goal
from roboirg.evaluation.play.job_instruction import PreparedJob
from roboirg.evaluation.play.prompt_shares import audit_job, audit_prompt
from roboirg.evaluation.records.action_log import ActionLog
from roboirg.evaluation.records.record import (
    Attribution,
    ErrorKind,
    EventRecord,
    GoalOutcomes,
    Job,
    MentionSpan,
    Outcome,
    PromptAudit,
    Record,
    SubgoalRecord,
    UtteranceRecord,
)
from roboirg.judging import attribute_failure
from roboirg.judging.episode_replay import decide
from roboirg.language.settings import EXPLICIT
from roboirg.policies.by_name.loading import server_version
from roboirg.policies.prompt_length.prompt_audit import PromptLimit
from roboirg.util.processor import processor_family
from roboirg.util.short_hash import DIGITS


@dataclass
class RolloutResult:
    """What happened in an episode; filled in step by step, so that an error keeps what came before.

    Attributes:
        outcome: success, failure or error.
        error: kind of the error; read only if the outcome is one.
        cause: why it is not a success.
        timed_out: whether the policy used up its steps.
        steps: control steps of the policy.
        demonstration_steps: frames of the video shown before the policy's turn.
        demonstration_source: whose actions it shows: recorded, planned or none.
        policy_start_step: control steps of the episode before the policy's turn.
        elapsed_steps: control steps of the episode in all.
        prepared: the job's episode and words, as far as they are made; None if none are.
        instruction: what was said; None if the episode did not get that far.
        heard: what the policy has heard so far, in order: ``text`` and ``step``.
        events: facts that became true or ceased to be.
        original: how it ended for the scene's own goal, if the words state another one.
        subgoals: what the policy's planner named.
        render_device: the driver's name; None if nothing was rendered.
        details: traceback of an error.
        policy: its version and whether it is privileged; None if it was never loaded.
        prompt_limit: what the policy declares about its prompt; None if it declares nothing.
        policy_metadata: what the policy reports about itself.
        needs: what it declares that it needs, or the job prescribes instead.
        inference: what its process computes with; None if it was not asked.
        action_space: name of the action space; None if the episode did not get that far.
        answers: what was executed of each answer of the policy.
        end_state: the state after the last of them, in numbers and as a hash; None before.
        usage: what the policy reports that the episode cost.
        timings: seconds spent in the policy and in the environment, by phase.
        attempt: how often the episode was begun.
    """

    outcome: Outcome = "error"
    error: ErrorKind | None = "environment"
    cause: str | None = "environment: the episode did not begin"
    timed_out: bool = False
    steps: int = 0
    demonstration_steps: int = 0
    demonstration_source: DemonstrationSource = "none"
    policy_start_step: int = 0
    elapsed_steps: int = 0
    prepared: PreparedJob | None = None
    instruction: language.Instruction | None = None
    heard: list[Mapping[str, Any]] = field(default_factory=list)
    events: list[EventRecord] = field(default_factory=list)
    original: str | None = None
    subgoals: list[SubgoalRecord] = field(default_factory=list)
    render_device: str | None = None
    details: str | None = None
    policy: PolicyDescription | None = None
    prompt_limit: PromptLimit | None = None
    policy_metadata: dict[str, JsonValue] = field(default_factory=dict)
    needs: dict[str, Any] = field(default_factory=dict)
    inference: InferenceFacts | None = None
    action_space: str | None = None
    answers: list[NDArray[np.float64]] = field(default_factory=list)
    end_state: tuple[NDArray[np.float64], str] | None = None
    usage: dict[str, float] = field(default_factory=dict)
    timings: dict[str, float] = field(default_factory=dict)
    attempt: int = 1

    @property
    def action_log(self) -> ActionLog | None:
        """The executed actions; None if the policy's turn never came, or the world broke."""
        if self.action_space is None or self.end_state is None:
            return None
        starts = np.cumsum([0, *map(len, self.answers)], dtype=np.int32)[:-1]
        width = find_action_space(self.action_space).size
        rows = np.concatenate([np.empty((0, width)), *self.answers])
        return ActionLog(self.action_space, rows, starts, self.end_state[0])

    def record_error(self, kind: ErrorKind, cause: str, details: str | None = None) -> None:
        """Record that the episode ended in an error and cannot be judged."""
        self.outcome, self.error, self.cause, self.details = "error", kind, cause, details

    def record_status(self, status: str, cause: str | None, max_steps: int) -> bool:
        """Record the final status. Returns False while the episode is running.

        Args:
            status: as the environment reports it.
            cause: of a failure, if the environment gives one.
            max_steps: the policy's limit, for the cause of a timeout.
        """
        if status == "success":
            self.outcome, self.cause = "success", None
        elif status == "timeout":
            self.outcome, self.timed_out = "failure", True
            self.cause = cause or f"not done after {max_steps} steps"
        elif status == "failure":
            self.outcome, self.cause = "failure", cause or "the judge gave no cause"
        else:
            return False
        return True

    def add_events(self, info: Mapping[str, Any]) -> None:
        """Add the events and the elapsed steps in an environment's info."""
        self.elapsed_steps = int(info.get("elapsed_steps", self.elapsed_steps))
        self.original = info.get("original")
        for event in info.get("events", ()):
            place = event.get("place")
            self.events.append(
                EventRecord(
                    step=int(event["step"]) - self.policy_start_step,
                    kind=str(event["kind"]),
                    subject=str(event["subject"]),
                    place=None if place is None else str(place),
                    holds=bool(event.get("holds", True)),
                )
            )


_COPIED = (
    "outcome",
    "steps",
    "demonstration_steps",
    "demonstration_source",
    "policy_metadata",
    "needs",
    "inference",
    "details",
    "render_device",
    "usage",
    "timings",
    "attempt",
)
"""Fields that a record has from the result as they are."""


def make_record(
    job: Job,
    result: RolloutResult,
    *,
    started_at: str,
    duration_s: float = 0.0,
    video: str | None = None,
    video_error: str | None = None,
    plan: str | None = None,
    action_log: str | None = None,
) -> Record:
    """Return the record of a job; needs no simulator.

    Args:
        job: what was played.
        result: how it went.
        started_at: ISO 8601, UTC.
        duration_s: wall-clock seconds.
        video: path of the video relative to the records file.
        video_error: why the requested video could not be written.
        plan: fingerprint of the plan.
        action_log: digest of the stored actions.
    """
    prepared = result.prepared or PreparedJob(job)
    episode = prepared.episode
    # An episode that failed before its reset has a record with the words it would have had.
    instruction = result.instruction or prepared.instruction
    is_explicit = job.setting == EXPLICIT and job.arm == TOLD
    explicit = instruction if is_explicit else prepared.explicit
    policy = result.policy or _describe(job)
    utterances = _utterances(job, instruction, result)
    prompt, verdict = _audit(job, instruction, utterances, result)
    goals, attribution = _analyze(prepared, result, instruction)
    return Record(
        **msgspec.structs.asdict(job),
        **{name: getattr(result, name) for name in _COPIED},
        seed=episode.seed,
        difficulty=episode.difficulty,
        cause=None if result.cause is None else clip_text(result.cause, MOST_CAUSE_LETTERS),
        error=result.error if result.outcome == "error" else None,
        attribution=attribution,
        goals=goals,
        instruction=utterances,
        prompt=prompt,
        prompt_verdict=verdict,
        mentions=tuple(MentionSpan(**asdict(one)) for one in instruction.mentions),
        command=explicit.text,
        goal=dict(episode.goal.as_mapping()),
        # Exactly what a reader of the file gets.
        metadata=json.loads(json.dumps(dict(instruction.metadata))),
        privileged=policy.is_privileged or result.action_space == CHOICE.name,
        policy_version=policy.version,
        server_version=server_version(result.policy_metadata),
        action_log=action_log,
        end_state=None if result.end_state is None else result.end_state[1],
        calls=len(result.answers),
        events=tuple(result.events),
        subgoals=tuple(result.subgoals),
        video=video,
        video_error=video_error,
        **_versions(),
        processor=processor_family(),
        plan=plan,
        started_at=started_at,
        duration_s=duration_s,
    )


def _audit(
    job: Job,
    instruction: language.Instruction,
    utterances: Sequence[UtteranceRecord],
    result: RolloutResult,
) -> tuple[PromptAudit | None, PromptVerdict]:
    """Return what of the instruction reached the policy's model, and the verdict."""
    if result.prompt_limit is None:
        return None, "unknown"
    steps = [one.step for one in utterances]
    try:
        if steps == [None] * len(steps):  # it ended before anything was said
            return audit_job(job, result.prompt_limit, instruction)
        return audit_prompt(instruction, steps, result.prompt_limit)
    except InvalidValueError:  # its tokenizer does not read this text
        return None, "unknown"


def _versions() -> dict[str, Any]:
    """Return the versions of what made a record, by its fields."""
    return {
        "language_version": str(language.LANGUAGE_VERSION),
        "environment_version": ENVIRONMENT_VERSION,
        "package_version": importlib.metadata.version("roboirgbench"),
        "code": code_fingerprint(),
    }


def _describe(job: Job) -> PolicyDescription:
    try:
        return describe_policy(job.policy_spec)
    except (InvalidValueError, MissingDependencyError):
        return PolicyDescription("unknown", is_privileged=False)


def _utterances(
    job: Job, instruction: language.Instruction, result: RolloutResult
) -> tuple[UtteranceRecord, ...]:
    """Return the utterances with the steps at which the policy heard them."""
    steps: list[int | None] = [0] * len(instruction.utterances)
    if job.options.delivery == TURNS:
        steps = [int(one["step"]) for one in result.heard]
    return tuple(
        UtteranceRecord(**asdict(one), step=step)
        for one, step in zip_longest(instruction.utterances, steps)
    )


def _analyze(
    prepared: PreparedJob, result: RolloutResult, instruction: language.Instruction
) -> tuple[GoalOutcomes | None, Attribution | None]:
    """Return which goals were reached, and why the episode failed.

    Without a verdict or events there is neither, and no attribution if the cause is unclear.
    """
    if result.outcome == "error" or not result.events:
        return None, None
    episode, start, elapsed = prepared.episode, result.policy_start_step, result.elapsed_steps
    events = judged_events(result.events, start)
    decision = decide(episode, events, elapsed)
    goals = find_goal_outcomes(episode, events, elapsed, decision, result.original)
    if result.outcome != "failure":
        return goals, None
    found = attribute_failure(
        episode,
        [event for event in events if event.step <= decision.step],
        timed_out=result.timed_out,
        policy_start_step=start,
        elapsed_steps=decision.step,
        cause=result.cause,
        # What mentions nothing, such as a scrambled text, has no sides to exchange.
        mirrored=language.mirrored_objects(episode, instruction) if instruction.mentions else None,
    )
    if found is not None and goals.original is not None:
        found = name_other_goal(found, prepared.scene_episode, goals)
    return goals, None if found is None else Attribution(**found._asdict())


def utc_now() -> str:
    """Return the time in ISO 8601, to the second."""
    return dt.datetime.now(dt.UTC).isoformat(timespec="seconds")


@functools.cache
def code_fingerprint() -> str:
    """Return a shortened SHA-256 of the names and bytes of the package's Python files."""
    digest = hashlib.sha256()
    root = Path(__file__).parents[2]
    for path in sorted(root.rglob("*.py")):
        digest.update(f"{path.relative_to(root).as_posix()}\0".encode())
        digest.update(path.read_bytes() + b"\0")
    return digest.hexdigest()[:DIGITS]
