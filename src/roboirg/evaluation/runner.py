"""A run: the plan, less what is already stored, played and stored."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections import Counter
from collections.abc import Generator, Iterable, Iterator, Sequence
from pathlib import Path
from types import FrameType
from typing import NamedTuple

from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.errors import InvalidValueError
from roboirg.episodes.splits import get_episode
from roboirg.evaluation.executors.executor import Executor
from roboirg.evaluation.plan import Plan, write_plan
from roboirg.evaluation.progress import Reporter, SilentReporter
from roboirg.evaluation.rollout import PlayJob
from roboirg.language import LANGUAGE_VERSION
from roboirg.policies.loading import policy_version
from roboirg.records.record import Job, Record
from roboirg.records.record_codec import RecordIndexEntry, identity_key
from roboirg.records.store import TORN_FILE, RecordStore, StoreError

UNREACHABLE_AFTER = 20
"""So many episodes of a policy in a row without a connection, and its others are left for later."""


class Terminated(KeyboardInterrupt):
    """The process was asked to go (SIGTERM); handled like Ctrl-C."""


class RunSummary(NamedTuple):
    """What a run found and did.

    Attributes:
        total: jobs in the plan.
        played: how many episodes were played now, further tries not counted.
        errors: of the plan's records, those that are neither success nor failure.
        missing: jobs of the plan that have no record.
        torn_bytes: of a line that a kill had cut short, moved to ``records.torn``.
        unfilmed: why films of new records could not be written.
        unreachable: policies that could not be reached again and again.
    """

    total: int
    played: int
    errors: tuple[RecordIndexEntry, ...]
    missing: int
    torn_bytes: int
    unfilmed: tuple[str, ...]
    unreachable: tuple[str, ...]


def run_plan(
    plan: Plan,
    folder: Path,
    play: PlayJob,
    executor: Executor,
    *,
    retry_errors: bool = True,
    reporter: Reporter | None = None,
) -> RunSummary:
    """Play what the plan has and the folder lacks; store each record the moment it arrives.

    An episode that ends in an error of one of the kinds `Plan.retry_on` is tried again after all
    others, up to `Plan.tries` times; the newest record counts.

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
    listener = reporter or SilentReporter()
    jobs = plan.jobs()
    with _sigterm_interrupts(), RecordStore(folder) as store:
        _report_damage(store, listener)
        _check_versions(store.stored.values(), folder)
        _check_policies(plan, store.stored.values(), folder)
        write_plan(plan, folder)
        keys = [identity_key(job) for job in jobs]
        todo = [
            job
            for job, key in zip(jobs, keys, strict=True)
            if _should_play(store.stored.get(key), retry_errors=retry_errors)
        ]
        listener.begin(len(jobs), len(jobs) - len(todo))
        course = _RunLoop(plan, store, listener)
        course.play(todo, play, executor)
        found = [store.stored.get(key) for key in keys]
        return RunSummary(
            total=len(jobs),
            played=len(course.tries),
            errors=tuple(one for one in found if one is not None and one.outcome == "error"),
            missing=found.count(None),
            torn_bytes=len(store.torn),
            unfilmed=tuple(course.unfilmed),
            unreachable=tuple(course.unreachable),
        )


class _RunLoop:
    """What a run has done so far.

    Attributes:
        tries: of each job, in this run.
        unfilmed: why films were lost.
        unreachable: policies that could not be reached again and again.
    """

    def __init__(self, plan: Plan, store: RecordStore, listener: Reporter) -> None:
        self._plan, self._store, self._listener = plan, store, listener
        self._unconnected: Counter[str] = Counter()
        self.tries: Counter[Job] = Counter()
        self.unfilmed: list[str] = []
        self.unreachable: list[str] = []

    def play(self, todo: Sequence[Job], play: PlayJob, executor: Executor) -> None:
        """Play jobs, and once more what ended in an error that may pass."""
        while todo:
            todo = self._play_once(todo, play, executor)

    def _play_once(self, todo: Sequence[Job], play: PlayJob, executor: Executor) -> list[Job]:
        """Play jobs; those that are to be played afterwards."""
        open_jobs, again = {identity_key(job): job for job in todo}, []
        with contextlib.closing(_iterate(executor, todo, play)) as records:
            for record in records:
                job = open_jobs.pop(identity_key(record))
                self._keep(job, record)
                if self._is_to_be_tried_again(job, record):
                    again.append(job)
                if self._has_lost_touch(record):
                    # The rest of the world goes on without it.
                    self._tell_unreachable(record)
                    again += open_jobs.values()
                    break
        return [job for job in again if job.policy not in self.unreachable]

    def _keep(self, job: Job, record: Record) -> None:
        before = self._store.stored.get(identity_key(job))
        if before is not None:
            record = record.model_copy(update={"attempt": before.attempt + 1})
        self._store.append(record)
        self.tries[job] += 1
        self._listener.advance(record, is_new=self.tries[job] == 1)
        if record.film_lost:
            self.unfilmed.append(record.film_lost)

    def _is_to_be_tried_again(self, job: Job, record: Record) -> bool:
        return record.error in self._plan.retry_on and self.tries[job] < self._plan.tries

    def _has_lost_touch(self, record: Record) -> bool:
        if record.error == "connection":
            self._unconnected[record.policy] += 1
        else:
            self._unconnected[record.policy] = 0
        return self._unconnected[record.policy] >= UNREACHABLE_AFTER

    def _tell_unreachable(self, record: Record) -> None:
        self.unreachable.append(record.policy)
        self._listener.notice(
            f"{record.policy} could not be reached in {UNREACHABLE_AFTER} episodes in a row "
            f"({record.cause}); its other episodes are left for another run."
        )


def _should_play(stored: RecordIndexEntry | None, *, retry_errors: bool) -> bool:
    return stored is None or (retry_errors and stored.outcome == "error")


def _report_damage(store: RecordStore, listener: Reporter) -> None:
    if store.torn:
        listener.notice(
            f"An earlier run was stopped in the middle of a line; its {len(store.torn)} bytes "
            f"were moved to {store.folder / TORN_FILE}."
        )
    if store.damaged:
        listener.notice(
            f"{store.path} has {len(store.damaged)} damaged lines, the first is line "
            f"{store.damaged[0]}; their episodes are played again."
        )


def _check_versions(records: Iterable[RecordIndexEntry], folder: Path) -> None:
    """Refuse to mix words or worlds of two versions: rates of different things are no rate."""
    records = tuple(records)
    for language in {record.language_version for record in records} - {LANGUAGE_VERSION}:
        raise StoreError(
            f"{folder} holds episodes told in language version {language}, but this roboirg "
            f"speaks {LANGUAGE_VERSION}; choose another --out."
        )
    for world in {record.environment_version for record in records} - {ENVIRONMENT_VERSION}:
        raise StoreError(
            f"{folder} holds episodes of environment version {world}, but this roboirg has "
            f"version {ENVIRONMENT_VERSION}; choose another --out."
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


def _check_policies(plan: Plan, records: Iterable[RecordIndexEntry], folder: Path) -> None:
    """Refuse to mix what two policies of the same name did."""
    versions = {name: policy_version(spec) for name, spec in plan.specs.items()}
    for policy, version in {(record.policy, record.policy_version) for record in records}:
        now = versions.get(policy, version)
        if version != now:
            raise StoreError(
                f"{folder} holds episodes of {policy} in version {version}, but it has changed "
                f"since (now {now}); choose another --out."
            )


def _seed(task: str, split: str, episode: int) -> str | int:
    """The seed of an episode's scene, or in words that there is none."""
    try:
        return get_episode(task, split, episode).seed
    except InvalidValueError:
        return "no such episode"


def _iterate(
    executor: Executor, jobs: Sequence[Job], play: PlayJob
) -> Generator[Record, None, None]:
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
