"""Run a plan: play the episodes that are not stored yet and store their records."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections import Counter, deque
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import NamedTuple

from roboirg.core.error_words import MAX_CAUSE_LENGTH
from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted
from roboirg.core.policy_ref import UNKNOWN_VERSION
from roboirg.core.versions import NO_VERSION, Mismatch
from roboirg.policies.vlm.models.reply_store import ReplySettings
from roboirg.records.film import VIDEO_FOLDER
from roboirg.records.record import Job, Record, Summary
from roboirg.records.record_codec import StoreError, identity_key
from roboirg.records.run_files import refuse_links
from roboirg.records.store import (
    RECORDS_FILE,
    TORN_FILE,
    RecordStore,
    check_same,
    read_index,
)
from roboirg.runs.episode_errors import Terminated, format_cause
from roboirg.runs.job_instruction import other_versions
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.stored_plans import write_plan
from roboirg.runs.play.rollout import EpisodeRunner, PlayJob
from roboirg.runs.play.video_writer import check_video_support, without_unfinished_videos
from roboirg.runs.run.executor import Executor
from roboirg.runs.run.progress import Reporter
from roboirg.runs.run.stop_watch import StopWatch
from roboirg.tasks.splits.splits import get_episode

UNREACHABLE_AFTER = 20
"""After this many consecutive connection errors, skip the rest of this policy."""

_HERE = "in this roboirg"


class RunSummary(NamedTuple):
    """Result of a run.

    Attributes:
        total: number of jobs in the plan.
        played: number of episodes played in this run, retries not counted.
        errors: records of the plan whose outcome is an error.
        missing: number of jobs of the plan without a record that should have one.
        video_errors: why videos of new records could not be written.
        unreachable: policies skipped after too many connection errors.
        spared: number of jobs that need no record, because what is compared was decided before.
    """

    total: int
    played: int
    errors: tuple[Summary, ...]
    missing: int
    video_errors: tuple[str, ...]
    unreachable: tuple[str, ...]
    spared: int = 0


def run_plan(
    plan: Plan,
    folder: Path,
    play: PlayJob,
    executor: Executor,
    *,
    retry_errors: bool = True,
    reporter: Reporter | None = None,
) -> RunSummary:
    """Play the jobs of a plan that the folder lacks; store each record as soon as it arrives.

    An episode that ends in an error is played again if the plan's `retry_on` has the kind of error,
    after all others, or next if its machine or process was lost. It is played `tries` times at most
    in a run; the newest record counts.

    Args:
        plan: what to play.
        folder: output folder of the run; holds the records.
        play: plays one job.
        executor: where jobs are played.
        retry_errors: play jobs again whose newest record is an error.
        reporter: gets every record, and first a line that was not finished.

    Raises:
        StoreError: another run writes to the folder, the records cannot be read or written, or
            they belong to another version of language, environment, scene or policy.
        RoboIRGError: an error that would end every episode (no Vulkan device, …).
        KeyboardInterrupt: Ctrl-C, or SIGTERM as `Terminated`; all finished episodes are stored.
    """
    if reporter is None:
        reporter = Reporter()
    jobs = plan.jobs()
    clean_videos = without_unfinished_videos(folder / VIDEO_FOLDER)
    with _sigterm_interrupts(), RecordStore(folder) as store, clean_videos:
        _report_torn_line(store, reporter)
        _check_versions(plan, store.stored.values(), folder)
        _warn_of_untrained(plan, reporter)
        todo = _jobs_to_play(plan, jobs, store, retry_errors=retry_errors)
        watch = None
        if plan.stop is not None:
            watch = StopWatch(plan, jobs, store, reporter)
            todo = watch.in_order(todo)
        write_plan(plan, folder)
        reporter.start(len(jobs), len(jobs) - len(todo), getattr(executor, "workers", None))
        loop = _RunLoop(plan, store, reporter, watch)
        loop.play(todo, play, executor)
        return loop.summary(jobs)


def _jobs_to_play(
    plan: Plan, jobs: Iterable[Job], store: RecordStore, *, retry_errors: bool
) -> list[Job]:
    """Return the jobs without a record, and with `retry_errors` those whose record is an error.

    If the plan stops when it is decided, its looks wait for errors with tries left in any case.
    """
    todo = []
    for job in jobs:
        stored = store.stored.get(identity_key(job))
        if stored is None:
            todo.append(job)
        elif stored.outcome == "error":
            is_awaited = plan.stop is not None and plan.attempts.has_left(stored)
            if retry_errors or is_awaited:
                todo.append(job)
    return todo


def episode_runner(plan: Plan, folder: Path) -> EpisodeRunner:
    """Return an object that plays jobs with the options of a plan and writes files to a folder.

    Raises:
        MissingDependencyError: the plan asks for videos, and PyAV is not installed.
    """
    if plan.video != "off":
        check_video_support()
    hosting = plan.hosting.settings
    if hosting is not None and plan.stop is not None:
        hosting = replace(hosting, keep_idle=True)
    return EpisodeRunner(
        folder,
        plan.video,
        policy_timeout_s=plan.hosting.policy_timeout_s,
        plan=plan.fingerprint,
        hosting=hosting,
        refuse_long=plan.long_prompts == "refuse",
        replies=ReplySettings(folder, plan.models.max_cost, plan.models.model_replies == "anew"),
    )


def check_run(plan: Plan, folder: Path) -> None:
    """Check what `run_plan` checks before it plays, and write nothing.

    Raises:
        StoreError: the folder cannot be written, or its records belong to another version of
            language, environment, scene or policy.
    """
    _check_writable(folder)
    refuse_links(folder)
    _check_versions(plan, read_index(folder).values(), folder)


def _check_writable(folder: Path) -> None:
    """Raise if a run's folder cannot be written, or cannot be made where there is none.

    Nothing is written.
    """
    existing = folder
    if not folder.exists():
        existing = next(parent for parent in folder.absolute().parents if parent.exists())
    if not existing.is_dir():
        raise StoreError(f"Cannot write to {folder}: {existing} is not a folder.")
    records = folder / RECORDS_FILE
    can_write = os.access(existing, os.W_OK | os.X_OK)
    if can_write and records.exists():
        can_write = os.access(records, os.W_OK)
    if not can_write:
        raise StoreError(f"Cannot write to {folder}: Permission denied.")


class _RunLoop:
    """Plays the jobs of a run, stores their records and retries errors.

    Attributes:
        tries: how often each job was played in this run.
        video_errors: why videos could not be written.
        unreachable: policies skipped after too many connection errors.
    """

    def __init__(
        self, plan: Plan, store: RecordStore, reporter: Reporter, watch: StopWatch | None = None
    ) -> None:
        self._plan = plan
        self._store = store
        self._reporter = reporter
        self._watch = watch  # of a run that stops when it is decided
        self._connection_errors: Counter[str] = Counter()  # in a row, by policy
        self.tries: Counter[Job] = Counter()
        self.video_errors: list[str] = []
        self.unreachable: list[str] = []

    def play(self, todo: Sequence[Job], play: PlayJob, executor: Executor) -> None:
        """Play jobs, store each record, and play jobs again that ended in an error to be retried.

        The jobs of a policy that cannot be reached are skipped.

        Args:
            todo: the jobs.
            play: plays one job.
            executor: where jobs are played.
        """
        queue = deque(todo)
        unneeded = [] if self._watch is None else self._watch.unneeded  # until it is opened again
        jobs = {identity_key(job): job for job in (*todo, *unneeded)}
        with contextlib.closing(executor.run(queue, play, self._reporter.warn)) as records:
            for record in records:
                job = jobs[identity_key(record)]
                self._store_record(job, record)
                self._queue_again(queue, job, record)
                if self._watch is not None:
                    self._watch.look(queue, job)

    def _queue_again(self, queue: deque[Job], job: Job, record: Record) -> None:
        """Put a job back into the queue if it is to be tried again; drop those of a lost policy.

        The executor takes its next job from this queue, so it is changed in place.
        """
        if self._is_unreachable(record):  # its remaining jobs are skipped
            remaining = [queued for queued in queue if queued.policy != record.policy]
            if self._watch is not None:
                remaining = []  # without one side nothing can be compared
                self._watch.give_up()
            queue.clear()
            queue.extend(remaining)
            return
        if not self._should_retry(job, record):
            return
        # What was lost with a machine can be played at once, and a scene that others wait for is.
        if record.error == "infrastructure" or self._watch is not None:
            queue.appendleft(job)
        else:
            queue.append(job)

    def summary(self, jobs: Sequence[Job]) -> RunSummary:
        """Return counts of played and missing jobs, and all errors, at the end of the run.

        `jobs` are all jobs of the plan, also those that were stored before.
        """
        records = [self._store.stored.get(identity_key(job)) for job in jobs]
        found = [record for record in records if record is not None]
        spared = 0 if self._watch is None else self._watch.spared(jobs)
        return RunSummary(
            total=len(jobs),
            played=len(self.tries),
            errors=tuple(record for record in found if record.outcome == "error"),
            missing=len(jobs) - len(found) - spared,
            video_errors=tuple(self.video_errors),
            unreachable=tuple(self.unreachable),
            spared=spared,
        )

    def _store_record(self, job: Job, record: Record) -> None:
        """Store a record, count it, and report it to the user.

        Raises:
            StoreError: a worker with other versions of the package or its words has made it.
        """
        check_same(
            f"A worker returned {record.slug}",
            other_versions(record),
            _HERE,
            "the record was not stored",
        )
        # Only code in the world's process can write this, such as a policy that patches the judge.
        if record.outcome == "success" and record.cause is not None:
            cause = format_cause("policy", f"a success came with a cause ({record.cause})")
            record.record_error("policy", cause[:MAX_CAUSE_LENGTH])
        earlier = self._store.stored.get(identity_key(job))
        if earlier is not None:
            record.attempt += earlier.attempt
        self._store.append(record)
        self.tries[job] += 1
        self._reporter.advance(record, is_new=self.tries[job] == 1)
        if record.video_error:
            self.video_errors.append(record.video_error)

    def _should_retry(self, job: Job, record: Record) -> bool:
        return (
            record.error in self._plan.attempts.retry_on
            and self.tries[job] < self._plan.attempts.tries
            and job.policy not in self.unreachable
        )

    def _is_unreachable(self, record: Record) -> bool:
        """Return whether a policy is to be given up now, because its server cannot be reached.

        That is so, with a warning, at the `UNREACHABLE_AFTER`-th connection error in a row.
        """
        policy = record.policy
        if record.error != "connection":
            self._connection_errors[policy] = 0
            return False
        self._connection_errors[policy] += 1
        if self._connection_errors[policy] != UNREACHABLE_AFTER:
            return False
        self.unreachable.append(policy)
        self._reporter.warn(
            f"{policy} could not be reached in {UNREACHABLE_AFTER} episodes in a row "
            f"({record.cause}); this run skips its remaining episodes."
        )
        return True


def _report_torn_line(store: RecordStore, reporter: Reporter) -> None:
    """Warn of a line that an earlier run did not finish, if there was one."""
    if store.torn:
        reporter.warn(
            f"An earlier run was stopped while it wrote a record; moved the unfinished line "
            f"({counted(len(store.torn), 'byte')}) to {store.folder / TORN_FILE}."
        )


def _warn_of_untrained(plan: Plan, reporter: Reporter) -> None:
    """Warn of tasks of the plan on which a policy was not trained, if it declares its tasks."""
    for policy in plan.policies:
        if policy.needs is None or policy.needs.trained_tasks is None:
            continue
        trained = policy.needs.trained_tasks
        untrained = [task for task in plan.tasks if task not in trained]
        if untrained:
            reporter.warn(
                f"{policy.name} plays {', '.join(untrained)}, which it was not trained on: it was "
                f"trained on {', '.join(trained)}."
            )


def _check_versions(plan: Plan, records: Collection[Summary], folder: Path) -> None:
    """Raise if a run's folder has records of other versions, as rates must not mix them.

    Compared are the versions of this package and of words, the seeds of scenes, and the policies.
    """
    what = f"{folder} holds episodes"
    for record in records:
        check_same(what, other_versions(record), _HERE)
    for scene in {(record.task, record.split, record.episode, record.seed) for record in records}:
        _check_scene(what, *scene)
    _check_policies(plan, records, folder)


def _check_scene(what: str, task: str, split: str, episode: int, seed: int) -> None:
    """Raise if an episode has another seed here than in records; `what` holds them."""
    expected: str | int = NO_VERSION
    with contextlib.suppress(InvalidValueError):
        expected = get_episode(task, split, episode).seed
    if seed != expected:
        of_scene = f"{what} of {task} {split}/{episode}"
        check_same(of_scene, [Mismatch("scene seed", seed, expected)], _HERE)


def _check_policies(plan: Plan, records: Iterable[Summary], folder: Path) -> None:
    """Raise if a folder has records of a planned policy in another version, or of its name only.

    Args:
        plan: with the policies that are to play.
        records: in the folder.
        folder: of the run, for the error.

    Raises:
        StoreError: it has.
    """
    planned = {ref.name: ref for ref in plan.policies}
    played = {(record.policy, record.policy_versions, record.outcome) for record in records}
    for name, versions, outcome in played:
        policy = planned.get(name)
        if policy is None:
            continue
        # If a policy cannot be opened, its version is unknown, and equal to another unknown one: a
        # verdict with that may still be of another version. An error with it does no harm.
        known = versions
        if outcome == "error" and versions.policy_version == UNKNOWN_VERSION:
            known = versions._replace(policy_version=None)
        elif policy.problem is not None:
            raise StoreError(
                f"{folder} holds episodes of {name} version {versions.policy_version}, but the "
                f"policy cannot be opened to read its version now ({policy.problem}); choose "
                "another --out."
            )
        what = f"{folder} holds episodes of {name}"
        check_same(what, known.differences(policy.versions))


@contextlib.contextmanager
def _sigterm_interrupts() -> Iterator[None]:
    """Treat SIGTERM like Ctrl-C while the block runs: raise `Terminated` in the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread can handle signals
        return

    received = threading.Event()

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        received.set()
        raise Terminated

    earlier_handler = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    except KeyboardInterrupt as error:  # a library such as Ray may raise it in place of ours
        kind = Terminated if received.is_set() else type(error)
        raise kind from error
    finally:
        signal.signal(signal.SIGTERM, earlier_handler)
