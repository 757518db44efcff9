"""A run: the plan, less what is already stored, played and stored."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path
from types import FrameType
from typing import NamedTuple

from roboirg.episode import ENVIRONMENT_VERSION
from roboirg.errors import InvalidValueError
from roboirg.evaluation.executors import Executor
from roboirg.evaluation.plan import Plan, write_plan
from roboirg.evaluation.progress import Reporter, Silent
from roboirg.evaluation.record import Job, Record
from roboirg.evaluation.rollout import Play
from roboirg.evaluation.store import TORN_FILE, RecordStore, StoreError, latest
from roboirg.language import LANGUAGE_VERSION
from roboirg.policies.loading import policy_version
from roboirg.splits import get_episode


class Terminated(KeyboardInterrupt):
    """The process was asked to go (SIGTERM); handled like Ctrl-C."""


class Summary(NamedTuple):
    """What a run found and did.

    Attributes:
        records: the newest of every job of the plan, in the plan's order.
        played: how many of them are new.
        torn_bytes: of a line that a kill had cut short, moved to ``records.torn``.
        unfilmed: the new records whose films could not be written.
    """

    records: tuple[Record, ...]
    played: int
    torn_bytes: int
    unfilmed: tuple[Record, ...]

    @property
    def errors(self) -> tuple[Record, ...]:
        """The records that are neither success nor failure."""
        return tuple(record for record in self.records if record.outcome == "error")


def run_plan(
    plan: Plan,
    folder: Path,
    play: Play,
    executor: Executor,
    *,
    retry_errors: bool = True,
    reporter: Reporter | None = None,
) -> Summary:
    """Play what the plan has and the folder lacks; store each record the moment it arrives.

    Args:
        plan: what should be there in the end.
        folder: of the run; holds the records.
        play: plays one job.
        executor: where.
        retry_errors: play jobs again whose newest record is an error.
        reporter: hears of each record, and at once of a line that a kill had cut short.

    Raises:
        StoreError: another run writes there, the records cannot be read or written, or they
            are of another language, environment, scene or policy than today's.
        RoboIRGError: what would end every episode (no Vulkan device, …).
        KeyboardInterrupt: Ctrl-C, or SIGTERM as `Terminated`; all that ended is stored.
    """
    listener = reporter or Silent()
    jobs = plan.jobs()
    with _sigterm_interrupts(), RecordStore(folder) as store:
        if store.torn:
            listener.notice(
                f"An earlier run was stopped in the middle of a line; its {len(store.torn)} bytes "
                f"were moved to {folder / TORN_FILE}."
            )
        _check_versions(store.records, folder)
        _check_policies(plan, store.records, folder)
        write_plan(plan, folder)
        stored = latest(store.records)
        todo = [
            job
            for job in jobs
            if job not in stored or (retry_errors and stored[job].outcome == "error")
        ]
        listener.begin(len(jobs), len(jobs) - len(todo))
        unfilmed = []
        with contextlib.closing(_iterate(executor, todo, play)) as records:
            for record in records:
                store.append(record)
                listener.advance(record)
                if record.film_lost:
                    unfilmed.append(record)
        newest = latest(store.records)
        return Summary(
            tuple(newest[job] for job in jobs), len(todo), len(store.torn), tuple(unfilmed)
        )


def _check_versions(records: Sequence[Record], folder: Path) -> None:
    """Refuse to mix words or worlds of two versions: rates of different things are no rate."""
    for record in records:
        if record.language_version != LANGUAGE_VERSION:
            raise StoreError(
                f"{folder} holds episodes told in language version {record.language_version}, but "
                f"this roboirg speaks {LANGUAGE_VERSION}; choose another --out."
            )
        if record.environment_version != ENVIRONMENT_VERSION:
            raise StoreError(
                f"{folder} holds episodes of environment version {record.environment_version}, "
                f"but this roboirg has version {ENVIRONMENT_VERSION}; choose another --out."
            )
    for task, split, episode, seed in {
        (record.task, record.split, record.episode, record.seed) for record in records
    }:
        expected = _seed(task, split, episode)
        if seed != expected:
            raise StoreError(
                f"{folder} holds {task} {split}/{episode} with the scene of seed {seed}, but in "
                f"this roboirg it has {expected}; choose another --out."
            )


def _check_policies(plan: Plan, records: Sequence[Record], folder: Path) -> None:
    """Refuse to mix what two policies of the same name did."""
    versions = {name: policy_version(name) for name in plan.policies}
    for record in records:
        now = versions.get(record.policy, record.policy_version)
        if record.policy_version != now:
            raise StoreError(
                f"{folder} holds episodes of {record.policy} in version {record.policy_version}, "
                f"but it has changed since (now {now}); choose another --out."
            )


def _seed(task: str, split: str, episode: int) -> str | int:
    """The seed of an episode's scene, or in words that there is none."""
    try:
        return get_episode(task, split, episode).seed
    except InvalidValueError:
        return "no such episode"


def _iterate(executor: Executor, jobs: Sequence[Job], play: Play) -> Generator[Record, None, None]:
    yield from executor.run(jobs, play)


@contextlib.contextmanager
def _sigterm_interrupts() -> Iterator[None]:
    """Stop at SIGTERM as at Ctrl-C: workers ended, records kept."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread hears signals
        return

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        raise Terminated

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
