"""Plays: episodes in which a body acts on the goal that was heard, each played once."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, NamedTuple, cast

import msgspec
from msgspec.structs import replace

from experiment.hearing import heard_goal
from experiment.rehearsing import WatchedPolicy, known_scene
from experiment.store import Entry, Key
from experiment.study import Study, Trial, body_of, circumstances, detector_of, show
from roboirg.core.instruction_options import InstructionOptions
from roboirg.records.record import Job, Record
from roboirg.records.record_codec import encode
from roboirg.runs.episode_errors import EpisodeError
from roboirg.runs.job_instruction import PreparedJob
from roboirg.runs.play.call_guard import CallGuard
from roboirg.runs.play.episode_record import begin_record
from roboirg.runs.play.policy_environment import job_needs
from roboirg.runs.play.rollout import play_with
from roboirg.runs.run.executor import choose_executor
from roboirg_learn.learn_support import check_learn_support
from roboirg_learn.policy.learned_policy import LearnedPolicy
from roboirg_learn.policy.policy_model import PolicyModel
from roboirg_learn.policy.subgoal_following import LearnedHands
from roboirg_learn.policy.trained_body import TrainedBody
from roboirg_learn.policy.trained_reader import HeardGoal

UNHEARD = InstructionOptions()
"""Explicit words, in which a play is recorded, as a record has some."""
START_STEP = "start_step"
"""In the metadata of a play's record: control steps of the world before the policy's turn."""


class Wanted(NamedTuple):
    """A play that a trial needs.

    Attributes:
        trial: the row and the text.
        heard: what the row's reader took it to mean.
        key: of the play, which other trials may share.
    """

    trial: Trial
    heard: HeardGoal
    key: Key


def wanted_plays(study: Study) -> Iterator[Wanted]:
    """Yield the play of every trial whose text was heard."""
    with study.open_store("hearings") as hearings:
        for trial in study.trials():
            heard = heard_goal(hearings, trial)
            if heard is not None:
                yield Wanted(trial, heard, trial.play_key(heard))


def play_missing(study: Study) -> None:
    """Play what is wanted and not stored yet; each play is on the disk when it has ended.

    Entries of a key agree in outcome, steps and the hash of all actions. An error is printed and
    not stored, so that it is played again at the next start.
    """
    with study.open_store("plays") as plays:
        missing = {}
        for wanted in wanted_plays(study):
            if plays.get(wanted.key) is None:
                missing[str(wanted.key)] = wanted
        # Plays of a scene follow each other, because a worker keeps its video.
        ordered = sorted(missing.values(), key=lambda wanted: wanted.key["episode"])
        code = circumstances()["code"]
        print(f"plays: {len(plays):,}, missing {len(ordered):,} of code {code}", flush=True)
        jobs: deque[Job] = deque()
        for number, wanted in enumerate(ordered):
            job = wanted.trial.job
            jobs.append(replace(job, policy="body", policy_seed=number, options=UNHEARD))
        play = partial(play_wanted, ordered)
        for done, record in enumerate(choose_executor(study.workers).run(jobs, play, print), 1):
            if record.outcome == "error":
                print(f"{record.task} {record.episode}: {record.cause}", flush=True)
            else:
                verdict = f"{record.outcome} {record.steps} {record.action_log}"
                key = dict(ordered[record.policy_seed].key)
                plays.add(Entry(key, verdict, msgspec.Raw(encode(record))))
            show("plays", done, len(ordered))


def play_wanted(every: Sequence[Wanted], job: Job) -> Record:
    """Play a job as a run does, with a body that is given its goal; return the record.

    Runs in worker processes. If the body does what another one did in the scene before, nothing is
    simulated: the record is that one's, with its times.

    Args:
        every: what is played.
        job: its seed is the number of the play among these, as nothing is drawn.
    """
    check_learn_support()
    wanted = every[job.policy_seed]
    scene = known_scene(replace(job, policy_seed=0))
    path = wanted.trial.row.body
    body = scene.with_eyes(body_of(path), detector_of(path))
    policy = WatchedPolicy(_acting(body, wanted.heard))
    prepared = PreparedJob(job)
    record = begin_record(prepared)
    guard = CallGuard(record.timings, None)
    try:
        with guard.policy("policy's act()", "policy_act"):
            known = scene.rehearse(_acting(body, wanted.heard))
        if known is not None:
            return replace(known, policy_seed=job.policy_seed)
        loop = play_with(policy, prepared, job_needs(policy, job), record, guard)
    except EpisodeError as error:
        record.record_error(error.kind, error.cause, error.details)
        return record
    loop.conclude()
    if loop.log is not None:
        record.action_log = loop.log.digest
    record.policy_metadata = {START_STEP: loop.start_step}
    record.duration_s = round(sum(record.timings.values()), 3)
    record.timings = {}
    if record.outcome != "error":
        scene.keep(policy, record)
    return record


def _acting(body: TrainedBody, heard: HeardGoal) -> LearnedPolicy:
    """Return a body as a policy that was given its goal."""
    model = PolicyModel(body, cast("Any", GoalGiven(heard)))
    return LearnedPolicy(model) if body.planner is None else LearnedHands(model)


@dataclass(frozen=True)
class GoalGiven:
    """Stands in for a reader of words: whatever is said, it hears the goal that it is given."""

    goal: HeardGoal
    plan: ClassVar[Mapping[str, Any]] = {"tasks": ()}
    version: ClassVar[str] = "given"

    def hear(self, _text: str, _looks: object) -> HeardGoal:
        return self.goal
