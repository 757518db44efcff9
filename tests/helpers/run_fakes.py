"""A way to play without a simulator, and the run that the crash tests kill."""

from __future__ import annotations

import hashlib
import os
import signal
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
from made_records import make_record

from roboirg.core.errors import RenderDeviceError
from roboirg.records.record import NON_DETERMINISTIC_FIELDS, EventRecord, Job, Record
from roboirg.records.store import RECORDS_FILE, read_records, read_results
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.plan_fields import SECTION_KEYS
from roboirg.runs.plan.plan_sections import StopRule
from roboirg.runs.plan.stopping import find_stopping
from roboirg.runs.run.executor import InProcess, LocalProcesses
from roboirg.runs.run.runner import RunSummary, run_plan
from roboirg.stats.anytime import SequentialDecision


def all_comparable(folder: Path) -> list[dict[str, object]]:
    records = sorted(read_records(folder), key=lambda record: record.slug)
    return [comparable(record) for record in records]


def line_count(folder: Path) -> int:
    path = folder / RECORDS_FILE
    return path.read_bytes().count(b"\n") if path.exists() else 0


@dataclass(frozen=True)
class FakePlay:
    """Plays nothing; the outcome follows from the job alone.

    Attributes:
        folder: where each start is noted, one file per process; None notes nothing.
        seconds: how long an episode takes.
        deadly: the episode in which the worker kills itself.
        deaths: how often it does so.
        fatal: the episode in which the graphics turn out to be missing.
        endless: from this episode on none ends.
    """

    folder: Path | None = None
    seconds: float = 0.0
    deadly: int | None = None
    deaths: int = 99
    fatal: int | None = None
    endless: int | None = None

    def __call__(self, job: Job) -> Record:
        started_at = str(time.time())
        if self.folder is not None:
            with (self.folder / f"worker-{os.getpid()}").open("a") as file:
                file.write(job.slug + "\n")
        if job.episode == self.fatal:
            raise RenderDeviceError("No Vulkan device can render; install one.")
        if job.episode == self.deadly and self._dies(job):
            os.kill(os.getpid(), signal.SIGKILL)
        time.sleep(self.seconds)
        while self.endless is not None and job.episode >= self.endless:
            time.sleep(1.0)
        return fake_record(job, started_at=started_at, duration_s=self.seconds)

    def _dies(self, job: Job) -> bool:
        return self.folder is None or len(starts(self.folder, job)) <= self.deaths


@dataclass(frozen=True)
class FakePlayer:
    """Plays nothing and writes a video of it.

    Attributes:
        gate: a file without which the episodes from `closed` on do not end; who waits for it
            leaves a file of its own next to it.
    """

    folder: Path
    seconds: float = 0.0
    fatal: int | None = None
    gate: Path | None = None
    closed: int = 0

    def in_folder(self, folder: Path) -> FakePlayer:
        return replace(self, folder=folder)

    def __call__(self, job: Job) -> Record:
        if self.gate is not None and job.episode >= self.closed:
            (self.gate.parent / f"waiting-{os.getpid()}").touch()
            while not self.gate.exists():
                time.sleep(0.05)
        record = FakePlay(seconds=self.seconds, fatal=self.fatal)(job)
        video = self.folder / "videos" / f"{job.slug}.mp4"
        video.parent.mkdir(exist_ok=True)
        video.write_text(job.slug)
        return msgspec.structs.replace(record, video=f"videos/{video.name}")


def fake_record(job: Job, **fields: object) -> Record:
    luck = hashlib.sha256(job.slug.encode()).digest()[0]
    events = (EventRecord(step=luck, kind="picked", subject="cube_red"),)
    wins = luck % 2 or job.setting == "explicit"
    outcome = ("success",) if wins else ("failure", "picked the wrong cube")
    return make_record(job, *outcome, steps=luck, events=events, **fields)


def comparable(record: Record) -> dict[str, object]:
    """Return the fields that depend only on the job."""
    told = msgspec.to_builtins(record)
    return {name: value for name, value in told.items() if name not in NON_DETERMINISTIC_FIELDS}


def starts(folder: Path, job: Job | None = None) -> list[str]:
    lines = [line for path in folder.glob("worker-*") for line in path.read_text().split()]
    return [line for line in lines if job is None or line == job.slug]


def worker_pids(folder: Path, kind: str = "worker") -> list[int]:
    return [int(path.name.removeprefix(f"{kind}-")) for path in folder.glob(f"{kind}-*")]


def is_alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state not in "ZX"


def small_plan(episodes: int = 4, policies: tuple[str, ...] = ("random",), seeds: int = 1) -> Plan:
    return Plan(
        policies=policies,
        tasks=("PickXtimes",),
        settings=("explicit", "direct"),
        episodes=tuple(range(episodes)),
        policy_seeds=tuple(range(seeds)),
    )


def fake_run(folder: Path, plan: Plan | None = None, **options: Any) -> RunSummary:
    """Run the small plan, or another one, in this process and without a simulator."""
    return run_plan(plan or small_plan(), folder, FakePlay(), InProcess(), **options)


def changed(plan: Plan, **options: object) -> Plan:
    """Return a plan with other options, which may stand in sections of it."""
    given = plan.model_dump()
    for section, keys in SECTION_KEYS.items():
        for key in options.keys() & keys:
            given[section] = {**given[section], key: options.pop(key)}
    return Plan.model_validate({**given, **options})


SCENES = 50


@dataclass(frozen=True)
class Lucky:
    """Plays nothing: the policy ``random`` wins 95 of 100 scenes, every other one 30."""

    seconds: float = 0.0

    def __call__(self, job: Job) -> Record:
        time.sleep(self.seconds)
        chance = 0.95 if job.policy == "random" else 0.3
        luck = hashlib.sha256(job.slug.encode()).digest()[0] / 256
        outcome = ("success",) if luck < chance else ("failure", "picked the wrong cube")
        return make_record(job, *outcome, duration_s=self.seconds)


def two_policies(episodes: int = SCENES, **options: object) -> Plan:
    """Return a plan of two policies in direct words that stops when it is decided."""
    plan = small_plan(episodes, policies=("random", "oracle"))
    return changed(plan, settings="direct", **{"stop": StopRule(), **options})


def found_in(folder: Path, plan: Plan) -> list[SequentialDecision]:
    """Return the decisions that the results in a folder give."""
    return find_stopping(plan, plan.jobs(), read_results(folder)).decisions


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    workers = int(sys.argv[2])
    run_plan(small_plan(8), folder, FakePlay(folder, endless=2), LocalProcesses(workers))
