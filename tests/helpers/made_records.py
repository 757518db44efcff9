"""Records of episodes that nobody played."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec

from roboirg.records.record import Job, Outcome, Record
from roboirg.records.store import RecordStore
from roboirg.runs.job_instruction import PreparedJob
from roboirg.runs.play.episode_record import begin_record, conclude_episode


def make_record(
    job: Job, outcome: Outcome = "error", cause: str | None = None, **fields: Any
) -> Record:
    """Return the record of a job that ended this way, with its other fields as given."""
    prepared = PreparedJob(job)
    record = begin_record(prepared)
    known = {"outcome": outcome, "cause": cause or record.cause, "started_at": "now", **fields}
    if outcome != "error":
        known |= {"error": None, "cause": cause}
    record = msgspec.structs.replace(record, **known)
    if outcome != "error":
        conclude_episode(record, prepared, 0)
    return record


def fill(folder: Path, *records: Record) -> Path:
    """Write records into the folder of a run, and return it."""
    with RecordStore(folder) as store:
        for record in records:
            store.append(record)
    return folder
