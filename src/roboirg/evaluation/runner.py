"""A run: the plan, less what is already stored, played and stored."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path
from types import FrameType
from typing import NamedTuple

from roboirg.evaluation.executors import Executor
from roboirg.evaluation.plan import Plan, write_plan
from roboirg.evaluation.progress import Reporter, Silent
from roboirg.evaluation.record import Job, Record
from roboirg.evaluation.rollout import Play
from roboirg.evaluation.store import TORN_FILE, RecordStore, StoreError, latest
from roboirg.language import LANGUAGE_VERSION


class Terminated(KeyboardInterrupt):
    """The process was asked to go (SIGTERM); handled like Ctrl-C."""


class Summary(NamedTuple):
    """What a run found and did.

    Attributes:
        records: the newest of every job of the plan, in the plan's order.
        played: how many of them are new.
        torn_bytes: of a line that a kill had cut short, moved to ``records.torn``.
    """

    records: tuple[Record, ...]
    played: int
    torn_bytes: int

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
        reporter: hears of each record.

    Raises:
        StoreError: another run writes there, the records cannot be read or written, or they
            are of another language version.
        RoboIRGError: what would end every episode (no Vulkan device, …).
        KeyboardInterrupt: Ctrl-C, or SIGTERM as `Terminated`; all that ended is stored.
    """
    listener = reporter or Silent()
    jobs = plan.jobs()
    with _sigterm_interrupts(), RecordStore(folder) as store:
        _check_language(store.records, folder)
        write_plan(plan, folder)
        stored = latest(store.records)
        todo = [
            job
            for job in jobs
            if job not in stored or (retry_errors and stored[job].outcome == "error")
        ]
        listener.begin(len(jobs), len(jobs) - len(todo))
        with contextlib.closing(_iterate(executor, todo, play)) as records:
            for record in records:
                store.append(record)
                listener.advance(record)
        newest = latest(store.records)
        return Summary(tuple(newest[job] for job in jobs), len(todo), len(store.torn))


def torn_notice(summary: Summary, folder: Path) -> str | None:
    """What to tell a person about a line that a kill had cut short."""
    if not summary.torn_bytes:
        return None
    return (
        f"The last run was stopped in the middle of a line; its {summary.torn_bytes} bytes were "
        f"moved to {folder / TORN_FILE} and the episode was played again."
    )


def _check_language(records: Sequence[Record], folder: Path) -> None:
    """Refuse to mix words of two versions: rates of different words are no rate."""
    for record in records:
        if record.language_version != LANGUAGE_VERSION:
            raise StoreError(
                f"{folder} holds episodes told in language version {record.language_version}, but "
                f"this roboirg speaks {LANGUAGE_VERSION}; choose another --out."
            )


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
