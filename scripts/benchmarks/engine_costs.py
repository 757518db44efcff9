"""Cost of the run engine apart from the episodes it plays."""

from __future__ import annotations

import atexit
import functools
import shutil
import tempfile
import time
from pathlib import Path

import msgspec

from roboirg.records.record import EventRecord, Job, Record
from roboirg.records.record_codec import encode
from roboirg.records.store import RECORDS_FILE, RecordStore
from roboirg.runs.job_instruction import PreparedJob
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.play.episode_record import begin_record
from roboirg.runs.play.rollout import EpisodeRunner
from roboirg.runs.run.executor import LocalProcesses
from roboirg.runs.run.progress import Reporter
from roboirg.runs.run.runner import run_plan

MANY_RECORDS = 100_000
_EVENTS = 60
"""About the number of events in an episode of BinFill."""


def engine_time() -> float:
    """Return seconds per episode from plan to record, through a worker that plays nothing."""
    plan = make_plan(["random"], tasks="PickXtimes", settings="explicit,direct", episodes="50")
    clock = _RecordClock()
    with tempfile.TemporaryDirectory() as folder:
        run_plan(plan, Path(folder), _unplayed_record, LocalProcesses(1), reporter=clock)
    # Excludes starting the process, which a run does once.
    return (clock.times[-1] - clock.times[0]) / (len(clock.times) - 1)


def episode_time() -> float:
    """Return seconds per episode of the oracle without pictures, the fastest kind."""
    plan = make_plan(["oracle"], tasks="PickXtimes,StopCube", settings="explicit", episodes="3")
    start = time.perf_counter()
    jobs = plan.jobs()
    with tempfile.TemporaryDirectory() as folder:
        for job in jobs:
            EpisodeRunner(Path(folder))(job)
    return (time.perf_counter() - start) / len(jobs)


def resume_time() -> float:
    """Return seconds until a run with 100,000 records knows which jobs remain."""
    plan, folder = _many_records()
    start = time.perf_counter()
    plan.jobs()
    with RecordStore(folder) as store:
        if len(store.stored) != MANY_RECORDS:
            raise AssertionError(f"{len(store.stored)} of {MANY_RECORDS} records were found")
    return time.perf_counter() - start


class _RecordClock(Reporter):
    """Notes the time of each record."""

    def __init__(self) -> None:
        self.times: list[float] = []

    def advance(self, record: Record, *, is_new: bool = True) -> None:
        """Note the time."""
        del record, is_new
        self.times.append(time.perf_counter())


def _unplayed_record(job: Job) -> Record:
    event = EventRecord(step=1, kind="picked", subject="cube_red")
    record = begin_record(PreparedJob(job))
    return msgspec.structs.replace(
        record, outcome="success", error=None, cause=None, events=(event,) * _EVENTS
    )


def temporary_folder() -> Path:
    """Return a new folder, which is removed when the process ends."""
    folder = Path(tempfile.mkdtemp(prefix="roboirg-bench-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@functools.cache
def _many_records() -> tuple[Plan, Path]:
    """Return a plan of 100,000 jobs and a folder with all their records."""
    plan = make_plan(
        ["random"],
        tasks="PickXtimes",
        settings="explicit,direct",
        episodes="50",
        policy_seeds=f"0-{MANY_RECORDS // 100 - 1}",
    )
    folder = temporary_folder()
    lines: dict[tuple[int, str], bytes] = {}
    with (folder / RECORDS_FILE).open("wb") as file:
        for job in plan.jobs():
            key = (job.episode, job.setting)
            if key not in lines:
                lines[key] = encode(_unplayed_record(job)) + b"\n"
            file.write(
                lines[key].replace(b'"policy_seed":0', b'"policy_seed":%d' % job.policy_seed)
            )
    return plan, folder
