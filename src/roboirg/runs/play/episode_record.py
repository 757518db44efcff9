"""The record of an episode: begun before it is played, and concluded from its events."""

from __future__ import annotations

import datetime as dt
import functools
import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import NamedTuple

import msgspec

from roboirg import language
from roboirg.core.delivery import TURNS
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.policy_ref import unknown_policy
from roboirg.core.version import __version__
from roboirg.judging import DeclaredIntent, Event, attribute_failure
from roboirg.judging.episode_replay import decide
from roboirg.policies.prompt_length.prompt_audit import PromptLimit
from roboirg.records.record import (
    Attribution,
    ErrorKind,
    Job,
    MentionSpan,
    Record,
    UtteranceRecord,
)
from roboirg.runs.episode_errors import format_cause
from roboirg.runs.job_instruction import PreparedJob
from roboirg.runs.play.goal_outcomes import find_goal_outcomes, judged_events, name_other_goal
from roboirg.runs.play.prompt_shares import audit_job, audit_prompt
from roboirg.util.processor import processor_family
from roboirg.util.short_hash import DIGITS

_VERDICT_FOLDERS = ("core/", "envs/", "judging/", "language/", "simulation/", "tasks/")
"""What decides a verdict on given actions: tasks, words, the simulation and the judge."""
_VERSION_FILE = "core/version.py"
"""Changes with every release, even if no verdict can."""


class CodeFingerprints(NamedTuple):
    """Shortened SHA-256 of the names and bytes of the package's files, data included.

    Attributes:
        package: of all files.
        verdict: of those that can change a verdict.
    """

    package: str
    verdict: str


def begin_record(prepared: PreparedJob) -> Record:
    """Return the record of an episode that has not begun, to be filled in; needs no simulator.

    It has the words that are to be said. Its outcome is an error until the episode ends. The policy
    in it lacks its needs: those with which it is played are a field of their own.
    """
    job = prepared.job
    words = prepared.words
    code = code_fingerprints()
    policy = job.ref or unknown_policy(job.policy)
    job_fields = msgspec.structs.asdict(job)
    job_fields["ref"] = replace(policy, needs=None, problem=None)
    # To JSON and back, so that the record has exactly what a reader of its file gets.
    metadata = json.loads(json.dumps(dict(words.instruction.metadata)))
    return Record(
        **job_fields,
        seed=words.episode.seed,
        difficulty=words.episode.difficulty,
        outcome="error",
        error="environment",
        cause="environment: the episode did not begin",
        instruction=utterances_at(prepared, ()),
        mentions=tuple(MentionSpan(**asdict(mention)) for mention in words.instruction.mentions),
        command=words.command,
        goal=dict(words.episode.goal.as_mapping()),
        metadata=metadata,
        language_version=metadata["language_version"],
        words=metadata["words"],
        environment_version=ENVIRONMENT_VERSION,
        package_version=__version__,
        code=code.package,
        verdict_code=code.verdict,
        processor=processor_family(),
        started_at=utc_now(),
        duration_s=0.0,
    )


def lost_record(job: Job, kind: ErrorKind, message: str) -> Record:
    """Return the record of an error for an episode of which nothing else is known."""
    record = begin_record(PreparedJob(job))
    record.record_error(kind, format_cause(kind, message))
    return record


def utterances_at(prepared: PreparedJob, heard_steps: Sequence[int]) -> tuple[UtteranceRecord, ...]:
    """Return the utterances of a job, each with the control step at which the policy heard it.

    If the job's words are not delivered in turns, all are heard at step 0.

    Args:
        prepared: the job.
        heard_steps: steps of the utterances heard so far, in order; that of all others is None.
    """
    in_turns = prepared.job.options.delivery == TURNS
    records = []
    for number, utterance in enumerate(prepared.words.instruction.utterances):
        step: int | None = 0
        if in_turns:
            step = heard_steps[number] if number < len(heard_steps) else None
        records.append(UtteranceRecord(**asdict(utterance), step=step))
    return tuple(records)


def audit_record(record: Record, prepared: PreparedJob, limit: PromptLimit) -> None:
    """Record how much of the instruction fits into what a policy's language model reads.

    If the episode ended before anything was said, all utterances count as said.

    Args:
        record: gets the audit and its verdict.
        prepared: its job.
        limit: most tokens of a prompt, as the policy declares it.

    Raises:
        InvalidValueError: the policy's tokenizer does not read this text.
    """
    instruction = prepared.words.instruction
    steps = [utterance.step for utterance in record.instruction]
    if all(step is None for step in steps):
        found = audit_job(record, limit, instruction)  # as if each were heard when it is said
    else:
        found = audit_prompt(instruction, steps, limit)
    record.prompt = found.audit
    record.prompt_verdict = found.verdict


def conclude_episode(
    record: Record,
    prepared: PreparedJob,
    start: int,
    *,
    timed_out: bool = False,
    original: str | None = None,
) -> None:
    """Record which goals an episode reached, and why it failed, if that is clear.

    Args:
        record: with a verdict; without events nothing can be concluded.
        prepared: its job.
        start: control steps of the episode before the policy's turn.
        timed_out: whether the policy used up its steps.
        original: status of the scene's own goal at the end, such as ``success``, if the words of
            the episode state another goal; else None.
    """
    if not record.events:
        return
    words = prepared.words
    events = judged_events(record.events, start)
    elapsed_steps = start + record.steps
    decision = decide(words.episode, events, elapsed_steps)
    goals = find_goal_outcomes(words, events, elapsed_steps, decision, original)
    record.goals = goals
    if record.outcome != "failure":
        return

    attempts = judged_events(record.attempts or (), start)
    # The objects that the words would mean if left and right were mistaken: taking one of them
    # explains the failure. A text that mentions nothing, such as a scrambled one, has no sides.
    mirrored = None
    if words.instruction.mentions:
        mirrored = language.mirrored_objects(words.episode, words.instruction)
    found = attribute_failure(
        words.episode,
        _until(decision.step, events),
        timed_out=timed_out,
        policy_start_step=start,
        elapsed_steps=decision.step,
        cause=record.cause,
        mirrored=mirrored,
        attempts=_until(decision.step, attempts),
        intent=declared_intent(record),
    )
    if found is not None and goals.original is not None:
        found = name_other_goal(found, prepared.scene_episode, goals)
    record.attribution = None if found is None else Attribution(**found._asdict())


def _until(step: int, events: Iterable[Event]) -> list[Event]:
    """Return the events up to a step, that one included."""
    return [event for event in events if event.step <= step]


def declared_intent(record: Record) -> DeclaredIntent | None:
    """Return what a policy declared that it would do in an episode; None if it declared nothing.

    A policy with a language reader reports the goal that it has understood in its metadata, as
    ``{"understood": {"color": "red"}}``, or None for no goal. Other policies name subgoals. As
    metadata may hold anything, a mapping counts as a goal only if it has one of the goal's slots.
    """
    # The default cannot be None, which means that no goal was understood.
    understood = record.policy_metadata.get("understood", "")
    is_goal = isinstance(understood, Mapping) and understood.keys() & record.goal
    if understood is None or is_goal:
        return DeclaredIntent(listens=True, understood=understood)
    if not record.subgoals:
        return None
    verdicts = tuple((subgoal.step, subgoal.verdict) for subgoal in record.subgoals)
    return DeclaredIntent(verdicts=verdicts)


def utc_now() -> str:
    """Return the time in ISO 8601, to the second."""
    return dt.datetime.now(dt.UTC).isoformat(timespec="seconds")


@functools.cache
def code_fingerprints() -> CodeFingerprints:
    """Return hashes of the package's files that this process runs: of all, and of some.

    The second hash is of the files that can change a verdict.
    """
    package = hashlib.sha256()
    verdict = hashlib.sha256()
    root = Path(__file__).parents[2]
    for path in sorted(root.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            name = path.relative_to(root).as_posix()
            content = f"{name}\0".encode() + path.read_bytes() + b"\0"
            package.update(content)
            if name.startswith(_VERDICT_FOLDERS) and name != _VERSION_FILE:
                verdict.update(content)
    return CodeFingerprints(package.hexdigest()[:DIGITS], verdict.hexdigest()[:DIGITS])
