"""Jobs played on many machines, by means of Ray.

Every seat of the cluster is an actor with one CPU that supervises a process of its own, just as
`LocalProcesses` does, so that policies and simulator are kept apart in the same way. A machine that
goes costs the jobs it had an error, which the runner tries again, and its seats are replaced where
there is room.
"""

from __future__ import annotations

import contextlib
import logging
import os
import socket
import sys
import tempfile
import time
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple, Protocol, Self, cast, runtime_checkable

from roboirg.core.errors import InvalidValueError, MissingDependencyError, RoboIRGError
from roboirg.evaluation.episode_errors import format_cause
from roboirg.evaluation.executors.executor import NO_TIMEOUT_S
from roboirg.evaluation.executors.workers import MAX_FAILED_STARTS, WorkerSlot
from roboirg.evaluation.rollout import PlayJob
from roboirg.evaluation.rollout_result import RolloutResult, make_record, utc_now
from roboirg.records.record import Job, Record

POLL_S = 1.0
NO_CPU_TIMEOUT_S = 300.0
"""How long a cluster may have no free CPU at all before the run gives up."""
CONNECT_S = 10.0


@runtime_checkable
class VideoRecorder(Protocol):
    """A way to play that leaves films in a folder, and can do so in another one."""

    folder: Path

    def in_folder(self, folder: Path) -> Self:
        """The same, for another folder."""


class _RemoteResult(NamedTuple):
    """What comes back from another machine.

    Attributes:
        record: of the job.
        films: bytes by path relative to the run's folder.
    """

    record: Record
    films: dict[str, bytes]


@dataclass(frozen=True, slots=True)
class RayCluster:
    """Plays jobs on a Ray cluster.

    Args:
        workers: seats at most; None for one on every CPU that the cluster has.
        address: of the cluster, as ``ray.init`` takes it; None joins the one that runs on this
            machine, or starts one here.
        episode_timeout_s: how long an episode may take.

    Raises:
        InvalidValueError: fewer than one worker.
        MissingDependencyError: Ray is not installed.
    """

    workers: int | None = None
    address: str | None = None
    episode_timeout_s: float = NO_TIMEOUT_S

    def __post_init__(self) -> None:
        if self.workers is not None and self.workers < 1:
            raise InvalidValueError(f"workers is {self.workers}; Ray needs at least 1.")
        import_ray()

    def run(self, jobs: Sequence[Job], play: PlayJob) -> Iterator[Record]:
        """Yield one record for each job, as they end."""
        ray = import_ray()
        with _connected(ray, self.address):
            count = self.workers or int(ray.cluster_resources().get("CPU", 1))
            company = _WorkerPool(ray, play, self.episode_timeout_s, min(count, len(jobs)))
            try:
                yield from company.play_all(jobs)
            finally:
                company.disband()


def import_ray() -> ModuleType:
    """The `ray` module.

    Raises:
        MissingDependencyError: it is not installed.
    """
    # It would report who uses it to its makers.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        import ray
    except ImportError as error:
        raise MissingDependencyError(
            f"Ray is not installed ({error}); run: pip install 'roboirgbench[ray]', or play with "
            "--executor local."
        ) from error
    return ray


@contextlib.contextmanager
def _connected(ray: ModuleType, address: str | None) -> Iterator[None]:
    if ray.is_initialized():
        yield  # by whoever calls us, whose it stays
        return
    _check_reachable(address)
    try:
        ray.init(address=address, logging_level=logging.WARNING, log_to_driver=False)
    except (ConnectionError, RuntimeError, ValueError) as error:
        words = " ".join(str(error).split())
        raise RoboIRGError(f"The Ray cluster {address!r} cannot be joined: {words}") from error
    try:
        yield
    finally:
        ray.shutdown()


def _user_paths() -> list[str]:
    """Where modules are found here that are not installed, such as policies of the user's."""
    prefixes = tuple({sys.prefix, sys.base_prefix})
    return [path for path in sys.path if path and not path.startswith(prefixes)]


def _video_recorder(play: object) -> VideoRecorder | None:
    return play if isinstance(play, VideoRecorder) else None


def _check_reachable(address: str | None) -> None:
    """Complain now if nobody listens: Ray would wait for minutes, and then end this process."""
    host, _, port = (address or "").removeprefix("ray://").rpartition(":")
    if not host or not port.isdigit():
        return  # a word, such as "auto"
    try:
        socket.create_connection((host, int(port)), timeout=CONNECT_S).close()
    except OSError as error:
        raise RoboIRGError(
            f"The Ray cluster {address!r} cannot be joined: {error.strerror or error}."
        ) from error


class _RemoteWorker:
    """What runs on the machines of the cluster: a seat whose films come back as bytes."""

    def __init__(self, play: PlayJob, episode_timeout_s: float) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="roboirg-"))
        filming = _video_recorder(play)
        # A `VideoRecorder` play stays one wherever it films.
        moved = play if filming is None else cast("PlayJob", filming.in_folder(self._folder))
        self._seat = WorkerSlot(moved, episode_timeout_s)

    def begin(self) -> None:
        """Answers as soon as the seat has found a place."""

    def play(self, job: Job) -> _RemoteResult:
        """Play a job."""
        record = self._seat.play(job)
        films = {}
        for path in sorted(self._folder.rglob("*")):
            if path.is_file():
                films[path.relative_to(self._folder).as_posix()] = path.read_bytes()
                path.unlink()
        return _RemoteResult(record, films)


class _WorkerPool:
    """The seats of a run and what each of them is playing."""

    def __init__(self, ray: ModuleType, play: PlayJob, episode_timeout_s: float, size: int) -> None:
        self._ray, self._play, self._episode_timeout_s = ray, play, episode_timeout_s
        self._actor = ray.remote(
            num_cpus=1,
            max_restarts=0,
            scheduling_strategy="SPREAD",
            runtime_env={"env_vars": {"PYTHONPATH": os.pathsep.join(_user_paths())}},
        )(_RemoteWorker)
        # What is awaited, with the seat it comes from and the job; None while it finds a place.
        self._awaited: dict[Any, tuple[Any, Job | None]] = {}
        self._idle: list[Any] = []
        self._size, self._stillborn = size, 0
        for _ in range(size):
            self._open_seat()

    def play_all(self, jobs: Sequence[Job]) -> Iterator[Record]:
        waiting = deque(jobs)
        left, lively = len(waiting), time.monotonic()
        while left:
            while waiting and self._idle:
                seat, job = self._idle.pop(), waiting.popleft()
                self._awaited[seat.play.remote(job)] = (seat, job)
            ready, _ = self._ray.wait(list(self._awaited), num_returns=1, timeout=POLL_S)
            for reference in ready:
                record = self._receive(reference)
                if record is not None:
                    left -= 1
                    yield record
            if ready or any(job is not None for _, job in self._awaited.values()):
                lively = time.monotonic()
            elif time.monotonic() - lively > NO_CPU_TIMEOUT_S:
                raise RoboIRGError(
                    f"The Ray cluster had no free CPU for {NO_CPU_TIMEOUT_S:g} s; {left} episodes are "
                    "left, and the same command goes on with them."
                )

    def disband(self) -> None:
        """Give all seats back."""
        for seat in [*self._idle, *(seat for seat, _ in self._awaited.values())]:
            self._ray.kill(seat)

    def _open_seat(self) -> None:
        seat = self._actor.remote(self._play, self._episode_timeout_s)
        self._awaited[seat.begin.remote()] = (seat, None)

    def _receive(self, reference: object) -> Record | None:
        seat, job = self._awaited.pop(reference)
        try:
            played = self._ray.get(reference)
        except (self._ray.exceptions.RayActorError, self._ray.exceptions.RaySystemError) as error:
            if job is None:
                self._bear(error)
            self._open_seat()
            return None if job is None else _lost_worker_record(job, error)
        self._idle.append(seat)
        if job is None:
            self._stillborn = 0
            return None
        self._keep_films(played)
        record: Record = played.record
        return record

    def _bear(self, error: BaseException) -> None:
        """A seat could not begin: its machine went, or it can never begin anywhere."""
        self._stillborn += 1
        if self._stillborn >= MAX_FAILED_STARTS * self._size:
            # The last line of Ray's text is the exception itself.
            words = str(error).strip().splitlines()[-1].strip()
            raise RoboIRGError(
                f"No worker of the Ray cluster can begin ({words}); every machine needs roboirg, "
                "and whatever the policies import."
            ) from error

    def _keep_films(self, played: _RemoteResult) -> None:
        filming = _video_recorder(self._play)
        if filming is None:
            return
        for name, data in played.films.items():
            path = filming.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)


def _lost_worker_record(job: Job, error: BaseException) -> Record:
    course = RolloutResult()
    name = type(error).__name__
    what = f"the machine or process that played it is gone ({name})"
    course.fail("infrastructure", format_cause("infrastructure", what))
    return make_record(job, course, started_at=utc_now())
