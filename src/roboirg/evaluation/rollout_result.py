"""How an episode went, and its record."""

from __future__ import annotations

import datetime as dt
import importlib.metadata
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pydantic import JsonValue

from roboirg import language
from roboirg.core.conditions import Fact
from roboirg.core.episode import ENVIRONMENT_VERSION, Episode
from roboirg.episodes.splits import get_episode
from roboirg.evaluation.code_fingerprint import code_fingerprint
from roboirg.evaluation.plan import instruct_job
from roboirg.judging import Event, attribute_failure
from roboirg.policies.loading import is_privileged, policy_version
from roboirg.records.record import (
    Attribution,
    ErrorKind,
    EventRecord,
    Job,
    MentionSpan,
    Outcome,
    Record,
    UtteranceRecord,
)


@dataclass
class RolloutResult:
    """How an episode went; filled while it goes, so that an error leaves what was before it.

    Attributes:
        outcome: success, failure or error.
        error: whose fault an error is.
        cause: why not success.
        timed_out: whether the policy's steps were used up.
        steps: control steps of the policy.
        demonstration_steps: frames of the video shown before.
        turn: control steps of the world before the policy's turn.
        elapsed: control steps of the world in all.
        events: what happened.
        render_device: driver's name, None if the episode did not get that far.
        details: traceback of an error.
        policy_metadata: what the policy says of itself.
        usage: what the policy says that the episode cost.
        timings: seconds spent in the policy and in the world, by phase.
    """

    outcome: Outcome = "error"
    error: ErrorKind | None = "environment"
    cause: str | None = "environment: the episode did not begin"
    timed_out: bool = False
    steps: int = 0
    demonstration_steps: int = 0
    turn: int = 0
    elapsed: int = 0
    events: list[EventRecord] = field(default_factory=list)
    render_device: str | None = None
    details: str | None = None
    policy_metadata: dict[str, JsonValue] = field(default_factory=dict)
    usage: dict[str, float] = field(default_factory=dict)
    timings: dict[str, float] = field(default_factory=dict)

    def fail(self, kind: ErrorKind, cause: str, details: str | None = None) -> None:
        """Nobody knows what the policy would have done."""
        self.outcome, self.error, self.cause, self.details = "error", kind, cause, details

    def settle(self, status: str, cause: str | None, steps: int) -> bool:
        """Take down how an episode ended after so many steps; whether the status is an end."""
        if status == "success":
            self.outcome, self.cause = "success", None
        elif status == "timeout":
            self.outcome, self.timed_out = "failure", True
            self.cause = cause or f"not done after {steps} steps"
        elif status == "failure":
            self.outcome, self.cause = "failure", cause or "the judge gave no cause"
        else:
            return False
        return True

    def note(self, info: Mapping[str, Any]) -> None:
        """Keep the events that the environment reports, and how far the world is."""
        self.elapsed = int(info.get("elapsed_steps", self.elapsed))
        for event in info.get("events", ()):
            place = event.get("place")
            self.events.append(
                EventRecord(
                    step=int(event["step"]) - self.turn,
                    kind=str(event["kind"]),
                    subject=str(event["subject"]),
                    place=None if place is None else str(place),
                    holds=bool(event.get("holds", True)),
                )
            )


def make_record(
    job: Job,
    course: RolloutResult,
    *,
    started_at: str,
    duration_s: float = 0.0,
    video: str | None = None,
    film_lost: str | None = None,
    plan: str | None = None,
) -> Record:
    """The record of a job that went so. Needs no simulator."""
    episode = get_episode(job.task, job.split, job.episode)
    instruction, plain = instruct_job(job), language.instruct(episode, "explicit")
    return Record(
        **dict(job),
        seed=episode.seed,
        difficulty=episode.difficulty,
        outcome=course.outcome,
        error=course.error if course.outcome == "error" else None,
        cause=course.cause,
        attribution=_attribution(episode, course),
        steps=course.steps,
        demonstration_steps=course.demonstration_steps,
        instruction=tuple(
            UtteranceRecord(stage=u.stage, text=u.text) for u in instruction.utterances
        ),
        mentions=tuple(
            MentionSpan(
                utterance=mention.utterance,
                start=mention.start,
                end=mention.end,
                role=mention.role,
                expression=mention.expression,
                slot=mention.slot,
                value=mention.value,
            )
            for mention in instruction.mentions
        ),
        command=plain.text,
        goal=dict(episode.goal.as_mapping()),
        # Exactly what a reader of the file will find.
        metadata=json.loads(json.dumps(dict(instruction.metadata))),
        privileged=is_privileged(job.policy_spec),
        policy_version=policy_version(job.policy_spec),
        policy_metadata=course.policy_metadata,
        events=tuple(course.events),
        video=video,
        film_lost=film_lost,
        details=course.details,
        render_device=course.render_device,
        language_version=str(language.LANGUAGE_VERSION),
        environment_version=ENVIRONMENT_VERSION,
        package_version=importlib.metadata.version("roboirgbench"),
        code=code_fingerprint(),
        plan=plan,
        usage=course.usage,
        timings=course.timings,
        started_at=started_at,
        duration_s=duration_s,
    )


def _attribution(episode: Episode, course: RolloutResult) -> Attribution | None:
    """Why the episode failed, if it did."""
    if course.outcome != "failure":
        return None
    found = attribute_failure(
        episode,
        [
            Event(
                event.step + course.turn,
                Fact(event.kind, event.subject, event.place),
                event.holds,
            )
            for event in course.events
        ],
        timed_out=course.timed_out,
        policy_start_step=course.turn,
        elapsed_steps=course.elapsed,
        cause=course.cause,
    )
    return None if found is None else Attribution(**found._asdict())


def utc_now() -> str:
    """The time, ISO 8601, to the second."""
    return dt.datetime.now(dt.UTC).isoformat(timespec="seconds")
