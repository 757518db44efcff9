"""The record of an episode: begun before it is played, and concluded from its events."""

from __future__ import annotations

import datetime as dt
import functools
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from itertools import zip_longest
from pathlib import Path

import msgspec
from msgspec import UNSET

from roboirg import language
from roboirg.core.delivery import TURNS
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.policy_ref import unknown_policy
from roboirg.core.version import __version__
from roboirg.evaluation.episode_errors import format_cause
from roboirg.evaluation.play.goal_outcomes import find_goal_outcomes, judged_events, name_other_goal
from roboirg.evaluation.play.job_instruction import PreparedJob
from roboirg.evaluation.play.prompt_shares import audit_job, audit_prompt
from roboirg.evaluation.records.record import (
    Attribution,
    ErrorKind,
    Job,
    MentionSpan,
    Record,
    UtteranceRecord,
)
from roboirg.judging import DeclaredIntent, attribute_failure
from roboirg.judging.episode_replay import decide
from roboirg.policies.prompt_length.prompt_audit import PromptLimit
from roboirg.util.processor import processor_family
from roboirg.util.short_hash import DIGITS


def begin_record(prepared: PreparedJob) -> Record:
    """Return the record of an episode that has not begun; needs no simulator.

    It has the words that are to be said, and the policy without its needs, as those with which it
    is played are a field of their own.
    """
    job, words = prepared.job, prepared.words
    policy = job.ref or unknown_policy(job.policy)
    # Exactly what a reader of the file gets.
    metadata = json.loads(json.dumps(dict(words.instruction.metadata)))
    return Record(
        **{**msgspec.structs.asdict(job), "ref": replace(policy, needs=None, problem=None)},
        seed=words.episode.seed,
        difficulty=words.episode.difficulty,
        outcome="error",
        error="environment",
        cause="environment: the episode did not begin",
        instruction=utterances_at(prepared, ()),
        mentions=tuple(MentionSpan(**asdict(one)) for one in words.instruction.mentions),
        command=words.command,
        goal=dict(words.episode.goal.as_mapping()),
        metadata=metadata,
        language_version=metadata["language_version"],
        words=metadata.get("words", UNSET),
        environment_version=ENVIRONMENT_VERSION,
        package_version=__version__,
        code=code_fingerprint(),
        processor=processor_family(),
        started_at=utc_now(),
        duration_s=0.0,
    )


def lost_record(job: Job, kind: ErrorKind, message: str) -> Record:
    """Return the record of an episode of which nothing is known but why it ended."""
    record = begin_record(PreparedJob(job))
    record.record_error(kind, format_cause(kind, message))
    return record


def utterances_at(prepared: PreparedJob, heard: Sequence[int]) -> tuple[UtteranceRecord, ...]:
    """Return the utterances of a job, given the steps at which those so far were heard."""
    utterances = prepared.words.instruction.utterances
    steps = heard if prepared.job.options.delivery == TURNS else [0] * len(utterances)
    return tuple(
        UtteranceRecord(**asdict(one), step=step) for one, step in zip_longest(utterances, steps)
    )


def audit_record(record: Record, prepared: PreparedJob, limit: PromptLimit) -> None:
    """Record what of the instruction reaches a policy's model: all of it if nothing was said yet.

    Raises:
        InvalidValueError: the policy's tokenizer does not read this text.
    """
    steps, words = [one.step for one in record.instruction], prepared.words.instruction
    is_silent = steps == [None] * len(steps)
    record.prompt, record.prompt_verdict = (
        audit_job(record, limit, words) if is_silent else audit_prompt(words, steps, limit)
    )


def conclude(
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
        original: how it ended for the scene's own goal, if the words state another one.
    """
    if not record.events:
        return
    episode, instruction, *_ = prepared.words
    events, elapsed = judged_events(record.events, start), start + record.steps
    decision = decide(episode, events, elapsed)
    goals = record.goals = find_goal_outcomes(prepared.words, events, elapsed, decision, original)
    if record.outcome != "failure":
        return
    found = attribute_failure(
        episode,
        [event for event in events if event.step <= decision.step],
        timed_out=timed_out,
        policy_start_step=start,
        elapsed_steps=decision.step,
        cause=record.cause,
        # What mentions nothing, such as a scrambled text, has no sides to exchange.
        mirrored=language.mirrored_objects(episode, instruction) if instruction.mentions else None,
        attempts=[
            event
            for event in judged_events(record.attempts or (), start)
            if event.step <= decision.step
        ],
        intent=declared_intent(record),
    )
    if found is not None and goals.original is not None:
        found = name_other_goal(found, prepared.scene_episode, goals)
    record.attribution = None if found is None else Attribution(**found._asdict())


def declared_intent(record: Record) -> DeclaredIntent | None:
    """Return what a policy declared that it would do; None if it did not.

    Policies' metadata may hold anything: a goal names slots of the task, or is None.
    """
    understood = record.policy_metadata.get("understood", "")
    if understood is None or (isinstance(understood, Mapping) and understood.keys() & record.goal):
        return DeclaredIntent(True, understood)
    said = tuple((one.step, one.verdict) for one in record.subgoals)
    return DeclaredIntent(verdicts=said) if said else None


def utc_now() -> str:
    """Return the time in ISO 8601, to the second."""
    return dt.datetime.now(dt.UTC).isoformat(timespec="seconds")


@functools.cache
def code_fingerprint() -> str:
    """Return a shortened SHA-256 of the names and bytes of the package's files, data included."""
    digest = hashlib.sha256()
    root = Path(__file__).parents[2]
    for path in sorted(root.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            digest.update(f"{path.relative_to(root).as_posix()}\0".encode())
            digest.update(path.read_bytes() + b"\0")
    return digest.hexdigest()[:DIGITS]
