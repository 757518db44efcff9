"""From hearings and plays to tables; and the proof that a play stands for what it is said to."""

from __future__ import annotations

import math
import random
from collections import deque
from collections.abc import Iterator
from functools import cache

import msgspec
import pandas as pd
from msgspec.structs import replace

from experiment.playing import START_STEP, Wanted, wanted_plays
from experiment.store import Entry
from experiment.study import TRUTH, Study, Trial
from roboirg.analysis.results.frame import make_frame
from roboirg.core.errors import RoboIRGError
from roboirg.policies.by_name.finding import policy_of
from roboirg.policies.resolving.resolving_policy import PASSED_ON, RESOLVED
from roboirg.records.record import Job, Record, Summary
from roboirg.runs.job_instruction import PreparedJob
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.play.episode_record import begin_record, conclude_episode
from roboirg.runs.run.executor import choose_executor
from roboirg.runs.run.runner import episode_runner
from roboirg.util.atomic_write import replacing

COLUMNS = (
    "policy", "policy_seed", "task", "suite", "split", "episode", "setting", "form",
    "instruction_options", "wordings", "outcome", "success", "steps", "failure_kind", "failure",
    "cause", "max_steps", "demonstration_steps", "language_version", "environment_version",
)  # fmt: skip
"""Columns of the frame, as `roboirg.results` has them."""
WORDS = ("options", "wordings_file", "instruction", "mentions", "command", "metadata", "words")
"""Fields of a record that come from what was said."""
SIDED = ("wrong_object", "wrong_place")
"""Failures that words with left and right may explain as a mirrored pick."""
COMPARED = (
    "outcome", "steps", "action_log", "end_state", "cause", "attribution", "goals", "events",
    "attempts", "subgoals", "instruction",
)  # fmt: skip
"""Fields in which the record made of a play must be that of the ordinary way."""


def write_frame(study: Study) -> None:
    """Write a row for each trial that was played.

    `roboirg.measure` takes the frame as it takes that of `roboirg.results`; the seed of a training
    is in the place of a policy's seed.
    """
    results = []
    heard = []
    for wanted, play in found_plays(study):
        record = record_of(wanted.trial, play)
        results.append(msgspec.convert(record, Summary, from_attributes=True))
        # Tasks of equal words are taken for each other, which changes no goal.
        heard.append(wanted.heard.answer == wanted.trial.true_goal.answer)
    frame = make_frame([(study.name, results)])
    table = pd.DataFrame({column: frame[column] for column in COLUMNS})
    table["heard_right"] = [heard[place] for place in frame["place"]]
    path = study.results / f"{study.name}.csv.xz"
    with replacing(path) as part:
        table.to_csv(part, index=False, compression="xz")
    print(f"{path}: {len(results):,} trials")


def found_plays(study: Study) -> Iterator[tuple[Wanted, Entry]]:
    """Yield what was wanted and is played, each with its play; print how much is not."""
    missing = 0
    with study.open_store("plays") as plays:
        for wanted in wanted_plays(study):
            play = plays.get(wanted.key)
            if play is None:
                missing += 1
            else:
                yield wanted, play
    print(f"not played: {missing:,}", flush=True)


def record_of(trial: Trial, entry: Entry) -> Record:
    """Return the record that a run would have: the words are the trial's, what happened the play's.

    Of the policy it has the name and what all seeds share.
    """
    play = msgspec.json.decode(entry.record, type=Record)
    row = trial.row
    said = _begun(trial.job)
    words = {name: getattr(said, name) for name in WORDS}
    record = replace(play, policy=row.policy, policy_seed=row.seed, ref=row.ref, **words)
    is_resolved = "understood" in trial.reported
    if row.namer:
        record.policy_metadata |= trial.reported
        record.usage = {RESOLVED if is_resolved else PASSED_ON: 1.0}
    is_sided = play.attribution is not None and play.attribution.failure in SIDED
    if is_sided or is_resolved:
        start = play.policy_metadata[START_STEP]
        late = f"not done after {trial.job.environment.max_steps} steps"
        conclude_episode(record, PreparedJob(trial.job), start, timed_out=play.cause == late)
    return record


@cache
def _begun(job: Job) -> Record:
    """Return the record of a job before it is played; all rows share its words."""
    return begin_record(PreparedJob(job))


def prove(study: Study) -> None:
    """Play random trials as a run does, with words and reader, and print what differs.

    Rows that are given the true goal are left out, as no words lead there. The actions are kept for
    packs.

    Raises:
        RoboIRGError: some differ.
    """
    found = [pair for pair in found_plays(study) if pair[0].trial.row.heard != TRUTH]
    chosen = random.Random(0).sample(found, math.ceil(study.proven * len(found)))
    # A process is started for each policy, so trials of one follow each other.
    chosen.sort(key=lambda pair: pair[0].trial.row)
    expected = {}
    jobs: deque[Job] = deque()
    for wanted, play in chosen:
        row = wanted.trial.row
        ref = policy_of(row.spec, f"{row.policy}-{row.seed}")
        job = replace(wanted.trial.job, policy=ref.name, ref=ref, policy_seed=row.seed)
        expected[job.slug] = record_of(wanted.trial, play)
        jobs.append(job)
    differing = 0
    runner = episode_runner(make_plan("oracle"), study.run)
    for again in choose_executor(study.workers).run(jobs, runner, print):
        of_play = expected[again.slug]
        names = [name for name in COMPARED if getattr(of_play, name) != getattr(again, name)]
        if names:
            differing += 1
            print(f"{again.slug} differs in {', '.join(names)}", flush=True)
    print(f"proof: {len(chosen)} trials were played in the ordinary way, {differing} differ")
    if differing:
        raise RoboIRGError("Plays do not stand for what they are said to.")
