"""Write a run of any size without a simulator, to measure what large runs cost.

Words, scenes and versions are real; outcomes and times of events are drawn at random, so that no
two records are alike, as in a run of learned policies. A record has about 5 KB.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from pathlib import Path

import msgspec
import numpy as np

from roboirg.core.conditions import Fact, FactCount, OccurrenceCount, facts_of
from roboirg.core.episode import Episode, Stage
from roboirg.records.record import Attribution, EventRecord, Job, Outcome, Record
from roboirg.records.record_codec import encode
from roboirg.records.store import RECORDS_FILE
from roboirg.runs.job_instruction import PreparedJob
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.plan.stored_plans import write_plan
from roboirg.runs.play.episode_record import begin_record
from roboirg.tasks.splits.splits import get_episode

POLICIES = tuple(f"policy-{letter}=random" for letter in "abcd")
EPISODES = 50
STARTED_AT = "2026-01-02T03:04:05+00:00"

_SUCCESS, _FAILURE = 0.55, 0.4
"""Shares of the outcomes; the rest are errors."""
_MOVE_STEPS = 28
"""Mean steps from one event that completes a stage to the next."""
_SEED = 7


def write_synthetic_run(folder: Path, count: int) -> Plan:
    """Write a plan of four policies on all tasks and settings, and records of its first jobs.

    Args:
        folder: created if missing; must hold no run.
        count: number of records. The plan has at least as many jobs and at most as many policy
            seeds as it needs; the other jobs are still to be played.

    Returns:
        The plan.
    """
    folder.mkdir(parents=True, exist_ok=True)
    once = make_plan(POLICIES, episodes=str(EPISODES))
    seeds = -(-count // len(once.jobs()))
    plan = once.model_copy(update={"policy_seeds": tuple(range(seeds))})
    write_plan(plan, folder)
    rng = np.random.default_rng(_SEED)
    with (folder / RECORDS_FILE).open("xb") as file:
        for record in _records(itertools.islice(plan.jobs(), count), rng):
            file.write(encode(record) + b"\n")
    return plan


def _records(jobs: Iterable[Job], rng: np.random.Generator) -> Iterator[Record]:
    """Yield the record of each job; those of one instruction are varied copies."""
    by_instruction: dict[Job, Record] = {}
    for job in jobs:
        key = msgspec.structs.replace(job, policy=POLICIES[0], policy_seed=0)
        if key not in by_instruction:
            by_instruction[key] = msgspec.structs.replace(
                begin_record(PreparedJob(job)),
                error=None,
                cause=None,
                started_at=STARTED_AT,
            )
        episode = get_episode(job.task, job.split, job.episode)
        yield _varied(by_instruction[key], job, episode, rng)


def _varied(record: Record, job: Job, episode: Episode, rng: np.random.Generator) -> Record:
    """Return a record with an outcome, events and times of its own."""
    share = rng.random()
    outcome: Outcome = "error"
    if share < _SUCCESS:
        outcome = "success"
    elif share < _SUCCESS + _FAILURE:
        outcome = "failure"
    events, shown = _events(episode, rng)
    if outcome != "success":
        last = rng.random() * events[-1].step
        events = [event for event in events if event.step <= last]
    steps = max(1, events[-1].step)
    subject = episode.stages[0].primitive.subject
    update: dict[str, object] = {
        "policy": job.policy,
        "policy_seed": job.policy_seed,
        "ref": job.ref,
        "outcome": outcome,
        "events": tuple(events),
        "steps": steps,
        "demonstration_steps": shown,
        "duration_s": round(steps / 100, 3),
        "timings": {"env_reset": 0.1, "policy_act": round(steps / 400, 3)},
    }
    if outcome == "failure":
        update |= {
            "cause": f"picked up {subject} at step {steps}",
            "attribution": Attribution(
                kind="grounding",
                failure="wrong_object",
                subject=subject,
                step=steps,
                sentence=f"Picked up {subject} instead of what was meant.",
            ),
        }
    elif outcome == "error":
        update |= {"error": "policy", "cause": "policy: ValueError: no action"}
    return msgspec.structs.replace(record, **update)


def _events(episode: Episode, rng: np.random.Generator) -> tuple[list[EventRecord], int]:
    """Return events that complete the stages, most of them, and the steps of the demonstration."""
    events = [(0, True, Fact("lying", item.name)) for item in episode.scene.objects]
    step = 0
    turn = 0
    for number, stage in enumerate((*episode.demonstration, *episode.stages)):
        for fact in _completing_facts(stage):
            start = step + int(rng.integers(8, 2 * _MOVE_STEPS))
            end = start + stage.lasting + int(rng.integers(2, 8))
            reached = Fact("reached", fact.subject)
            events.append(((step + start) // 2, True, reached))
            events.append((start, True, fact))
            events.append((end, False, reached))
            events.append((end, False, fact))
            step = end
        if number < len(episode.demonstration):
            turn = step + 1
    records = []
    for at, holds, fact in events:
        records.append(EventRecord(step=at - turn, holds=holds, **fact._asdict()))
    return records, turn


def _completing_facts(stage: Stage) -> tuple[Fact, ...]:
    """Return the facts whose starts meet what a stage expects, if nothing but facts matters."""
    match stage.expects:
        case OccurrenceCount(facts, least):
            return facts[:1] * least
        case FactCount(facts, least):
            return facts[:least]
        case other:
            return facts_of(other)
