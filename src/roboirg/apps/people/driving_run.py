"""Play an episode that a person drives, and store its record."""

from __future__ import annotations

import time
from pathlib import Path

import msgspec

from roboirg.apps.people.driving_policy import DrivingPolicy
from roboirg.apps.people.driving_session import DrivingSession, DrivingStoppedError
from roboirg.core.errors import RoboIRGError
from roboirg.evaluation.episode_errors import EpisodeError
from roboirg.evaluation.hosting.policy_descriptions import PolicyDescription
from roboirg.evaluation.play.call_guard import CallGuard
from roboirg.evaluation.play.policy_environment import job_needs
from roboirg.evaluation.play.rollout import play_with
from roboirg.evaluation.play.rollout_result import RolloutResult, make_record, utc_now
from roboirg.evaluation.records.action_log import write_actions
from roboirg.evaluation.records.record import Job, Record
from roboirg.evaluation.records.record_codec import identity_key
from roboirg.evaluation.records.store import RecordStore, read_index

DRIVER = "person"
"""Name of the policy in records."""
VERSION = "person"


def drive_episode(job: Job, folder: Path, session: DrivingSession) -> Record | None:
    """Play a job with a person's commands; store and return the record.

    Whatever goes wrong is shown to the person.

    Args:
        job: what to play, with the policy's name and seed.
        folder: of the records.
        session: shared with the page.

    Returns:
        None if the person stopped before the end, or the episode could not be played.
    """
    try:
        record = _play(job, folder, session)
    except RoboIRGError as error:
        session.fail(str(error))
        return None
    if record is not None:
        session.finish(record)
    return record


def next_seed(job: Job, folder: Path) -> int:
    """Return the first policy seed with which a folder has no record of a job."""
    stored, seed = read_index(folder), 0
    while identity_key(msgspec.structs.replace(job, policy_seed=seed)) in stored:
        seed += 1
    return seed


def _play(job: Job, folder: Path, session: DrivingSession) -> Record | None:
    started_at, start = utc_now(), time.monotonic()
    policy, result = DrivingPolicy(session), RolloutResult()
    result.policy = PolicyDescription(VERSION, is_privileged=False)
    try:
        needs = job_needs(policy, job)
        play_with(policy, job, needs, result, CallGuard(result, None), session)
    except EpisodeError as error:
        if isinstance(error.__cause__, DrivingStoppedError):
            return None
        result.record_error(error.kind, error.cause, error.details)
    log = result.action_log
    record = make_record(
        job,
        result,
        started_at=started_at,
        duration_s=round(time.monotonic() - start, 3),
        action_log=None if log is None else write_actions(log, folder),
    )
    with RecordStore(folder) as store:
        store.append(record)
    return record
