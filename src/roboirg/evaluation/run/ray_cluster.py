"""Play jobs on many machines with Ray.

Each remote worker is an actor with one CPU that supervises a process of its own, as
`LocalProcesses` does, so that policies and simulator are isolated in the same way; the workers on a
machine share its policy hosts. When a machine is lost, its current jobs get error records, which
the runner retries, and its workers are replaced where CPUs are free.
"""

from __future__ import annotations

import contextlib
import functools
import logging
import os
import secrets
import socket
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple, Protocol, Self, cast, runtime_checkable

from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.core.extras import extra_needed
from roboirg.core.plain_text import counted
from roboirg.evaluation.episode_errors import format_cause
from roboirg.evaluation.hosting.host_pool import HostPool, HostSettings
from roboirg.evaluation.play.rollout import PlayJob
from roboirg.evaluation.play.rollout_result import RolloutResult, make_record, utc_now
from roboirg.evaluation.records.record import Job, Record
from roboirg.evaluation.run.executor import NO_TIMEOUT_S
from roboirg.evaluation.run.workers import MAX_FAILED_STARTS, WorkerSlot
from roboirg.tasks.splits.private_splits import known_salt, use_salt

POLL_S = 1.0
NO_CPU_TIMEOUT_S = 300.0
"""How long a cluster may have no free CPU before the run stops."""
CONNECT_S = 10.0
KEY_S = 1.0
"""How long a client of a machine's hosts may take to send its key."""
CLOSE_S = 10.0
"""How long the hosts of all machines may take to end before they are killed."""


@runtime_checkable
class VideoRecorder(Protocol):
    """A function that plays jobs and writes videos to a folder that can be changed."""

    folder: Path

    def in_folder(self, folder: Path) -> Self:
        """Return a copy that writes its videos to another folder."""


class _RemoteResult(NamedTuple):
    """Reply of a remote worker.

    Attributes:
        record: record of the job.
        files: contents of the videos and posters by path relative to the run's folder.
    """

    record: Record
    files: dict[str, bytes]


@dataclass(frozen=True, slots=True)
class RayCluster:
    """Plays jobs on a Ray cluster.

    Args:
        workers: most workers at a time; None for one on every CPU of the cluster.
        address: of the cluster, as for ``ray.init``; None joins the cluster that runs on this
            machine or starts one.
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
        """Yield one record for each job as they finish.

        Raises:
            RoboIRGError: the cluster cannot be joined, has no free CPU, or no worker can start.
        """
        ray = import_ray()
        with _connected(ray, self.address):
            count = self.workers or int(ray.cluster_resources().get("CPU", 1))
            pool = _WorkerPool(ray, play, self.episode_timeout_s, min(count, len(jobs)))
            try:
                yield from pool.play_all(jobs)
            finally:
                pool.close()


def import_ray() -> ModuleType:
    """Import and return the `ray` module.

    Raises:
        MissingDependencyError: it is not installed.
    """
    # Ray would send usage statistics to its developers.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    with extra_needed("--executor ray needs Ray", "ray"):
        import ray
    return ray


@contextlib.contextmanager
def _connected(ray: ModuleType, address: str | None) -> Iterator[None]:
    if ray.is_initialized():
        yield  # the caller connected, so the caller disconnects
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
    """Return the import path without installed packages: where a user's policies are."""
    prefixes = tuple({sys.prefix, sys.base_prefix})
    return [path for path in sys.path if path and not path.startswith(prefixes)]


def _video_recorder(play: object) -> VideoRecorder | None:
    return play if isinstance(play, VideoRecorder) else None


def _check_reachable(address: str | None) -> None:
    """Check that the address accepts connections; Ray would wait minutes and then exit."""
    host, _, port = (address or "").removeprefix("ray://").rpartition(":")
    if not host or not port.isdigit():
        return  # a word such as "auto"
    try:
        socket.create_connection((host, int(port)), timeout=CONNECT_S).close()
    except OSError as error:
        raise RoboIRGError(
            f"The Ray cluster {address!r} cannot be joined: {error.strerror or error}."
        ) from error


class HostAddress(NamedTuple):
    """Where the policy hosts of a machine listen, for other actors there.

    Attributes:
        path: of the socket.
        key: proves that a client belongs to the run; policies do not know it.
    """

    path: str
    key: bytes

    def connect(self) -> socket.socket:
        """Return a new line to the hosts."""
        line = socket.socket(socket.AF_UNIX)
        line.connect(self.path)
        line.sendall(self.key)
        return line


class _MachineHosts:
    """Actor that holds the policy hosts of a machine; all workers there use them."""

    def __init__(self, settings: HostSettings) -> None:
        self._pool = HostPool(settings)
        # In /tmp, because the path of a socket may have 100 characters only.
        self._folder = tempfile.TemporaryDirectory(prefix="roboirg-", dir="/tmp")
        path = str(Path(self._folder.name) / "hosts")
        self._address = HostAddress(path, secrets.token_bytes(32))
        self._door = socket.socket(socket.AF_UNIX)
        self._door.bind(path)
        self._door.listen()
        threading.Thread(target=self._open_lines, daemon=True).start()

    def _open_lines(self) -> None:
        """Serve everyone who has the key; who does not send it at once is sent away."""
        while True:
            try:
                line, _ = self._door.accept()
            except OSError:
                return
            line.settimeout(KEY_S)
            with contextlib.suppress(OSError):
                if secrets.compare_digest(line.recv(len(self._address.key)), self._address.key):
                    line.settimeout(None)
                    self._pool.serve(line)
                    continue
            line.close()

    def address(self) -> HostAddress:
        """Return where they are, for processes on the same machine."""
        return self._address

    def close(self) -> None:
        """End them."""
        self._door.close()
        self._pool.close()
        self._folder.cleanup()


class _RemoteWorker:
    """Actor that runs on a machine of the cluster and returns videos as bytes."""

    def __init__(self, play: PlayJob, episode_timeout_s: float, salt: str | None) -> None:
        if salt is not None:
            use_salt(salt)
        self._folder = Path(tempfile.mkdtemp(prefix="roboirg-"))
        recorder = _video_recorder(play)
        self._play = play if recorder is None else recorder.in_folder(self._folder)
        self._episode_timeout_s = episode_timeout_s
        self._slot: tuple[HostAddress | None, WorkerSlot] | None = None

    def machine(self) -> str:
        """Return the id of the machine as soon as the actor runs on it."""
        return str(import_ray().get_runtime_context().get_node_id())

    def play(self, job: Job, hosts: HostAddress | None) -> _RemoteResult:
        """Play a job with the policy hosts of this machine, if there are some."""
        if self._slot is None or self._slot[0] != hosts:  # these may have been started again
            if self._slot is not None:
                self._slot[1].close()
            connect = None if hosts is None else hosts.connect
            self._slot = (
                hosts,
                WorkerSlot(cast("PlayJob", self._play), self._episode_timeout_s, connect),
            )
        record = self._slot[1].play(job)
        files = {}
        for path in sorted(self._folder.rglob("*")):
            if path.is_file():
                files[path.relative_to(self._folder).as_posix()] = path.read_bytes()
                path.unlink()
        return _RemoteResult(record, files)


class _WorkerPool:
    """The remote workers of a run and their current jobs."""

    def __init__(self, ray: ModuleType, play: PlayJob, episode_timeout_s: float, size: int) -> None:
        self._ray, self._play, self._episode_timeout_s = ray, play, episode_timeout_s
        variables = {
            "PYTHONPATH": os.pathsep.join(_user_paths()),
            # Or older versions of Ray hide the GPUs from actors that reserve none.
            "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
        }
        self._remote = functools.partial(ray.remote, runtime_env={"env_vars": variables})
        self._actor = self._remote(num_cpus=1, max_restarts=0, scheduling_strategy="SPREAD")(
            _RemoteWorker
        )
        self._hosting = getattr(play, "hosting", None)
        # By id of a machine: the actor that holds its policy hosts.
        self._hosts: dict[str, Any] = {}
        # By pending call: its worker, its machine and its job; both None while the worker starts.
        self._pending: dict[Any, tuple[Any, str | None, Job | None]] = {}
        self._idle: list[tuple[Any, str]] = []
        self._size, self._failed_starts = size, 0
        for _ in range(size):
            self._start_worker()

    def play_all(self, jobs: Sequence[Job]) -> Iterator[Record]:
        """Yield one record for each job as they finish."""
        waiting = deque(jobs)
        left, last_active = len(waiting), time.monotonic()
        while left:
            while waiting and self._idle:
                (worker, machine), job = self._idle.pop(), waiting.popleft()
                call = worker.play.remote(job, self._hosts_at(machine))
                self._pending[call] = (worker, machine, job)
            ready, _ = self._ray.wait(list(self._pending), num_returns=1, timeout=POLL_S)
            for reference in ready:
                record = self._receive(reference)
                if record is not None:
                    left -= 1
                    yield record
            if ready or any(job is not None for _, _, job in self._pending.values()):
                last_active = time.monotonic()
            elif time.monotonic() - last_active > NO_CPU_TIMEOUT_S:
                raise RoboIRGError(
                    f"The Ray cluster had no free CPU for {NO_CPU_TIMEOUT_S:g} s; run the same "
                    f"command again to play the remaining {counted(left, 'episode')}."
                )

    def close(self) -> None:
        """Kill all workers, and end the hosts."""
        for worker, *_ in (*self._idle, *self._pending.values()):
            self._ray.kill(worker)
        closing = [hosts.close.remote() for hosts in self._hosts.values()]
        if closing:
            self._ray.wait(closing, num_returns=len(closing), timeout=CLOSE_S)
        for hosts in self._hosts.values():
            self._ray.kill(hosts)

    def _start_worker(self) -> None:
        worker = self._actor.remote(self._play, self._episode_timeout_s, known_salt())
        self._pending[worker.machine.remote()] = (worker, None, None)

    def _hosts_at(self, machine: str) -> Any:  # noqa: ANN401 - a reference
        """Return a reference to the address of a machine's hosts; None if none are needed."""
        if self._hosting is None:
            return None
        if machine not in self._hosts:
            from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

            there = NodeAffinitySchedulingStrategy(machine, soft=False)
            actor = self._remote(num_cpus=0, max_restarts=-1, scheduling_strategy=there)
            self._hosts[machine] = actor(_MachineHosts).remote(self._hosting)
        return self._hosts[machine].address.remote()

    def _receive(self, reference: object) -> Record | None:
        """Return the record of a finished call; None if the call only started a worker."""
        worker, machine, job = self._pending.pop(reference)
        try:
            reply = self._ray.get(reference)
        except (self._ray.exceptions.RayActorError, self._ray.exceptions.RaySystemError) as error:
            self._ray.kill(worker)
            if job is None:
                self._count_failed_start(error)
            self._start_worker()
            return None if job is None else _lost_worker_record(job, error)
        self._idle.append((worker, reply if machine is None else machine))
        if job is None:
            self._failed_starts = 0
            return None
        self._save_files(reply)
        record: Record = reply.record
        return record

    def _count_failed_start(self, error: BaseException) -> None:
        """Count a worker that could not start; stop if that happens again and again."""
        self._failed_starts += 1
        if self._failed_starts >= MAX_FAILED_STARTS * self._size:
            # The last line of Ray's message is the exception itself.
            words = str(error).strip().splitlines()[-1].strip()
            raise RoboIRGError(
                f"No worker of the Ray cluster can start ({words}); every machine needs roboirg "
                "and everything that the policies import."
            ) from error

    def _save_files(self, reply: _RemoteResult) -> None:
        recorder = _video_recorder(self._play)
        if recorder is None:
            return
        for name, data in reply.files.items():
            path = recorder.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)


def _lost_worker_record(job: Job, error: BaseException) -> Record:
    result = RolloutResult()
    message = f"the machine or process that played it was lost ({type(error).__name__})"
    result.record_error("infrastructure", format_cause("infrastructure", message))
    return make_record(job, result, started_at=utc_now())
