"""What a run starts on each machine of a Ray cluster.

| actor | how many | content |
| --- | --- | --- |
| `MachineAgent` | one a machine | checks the machine, holds its policy hosts, ends frozen workers |
| `RemoteWorker` | one an episode under way | supervises a process of its own, as local workers do |

Both answer `beat` in a thread of its own, so that the driver notices a frozen one.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import signal
import socket
import tempfile
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from roboirg.core.error_words import one_line
from roboirg.core.errors import RoboIRGError
from roboirg.core.policy_ref import UNKNOWN_VERSION, PolicyRef
from roboirg.core.version import __version__
from roboirg.core.versions import Versions
from roboirg.policies.by_name.finding import read_policy
from roboirg.records.record import Job, Record
from roboirg.runs.hosting.host_pool import HostPool, HostSettings
from roboirg.runs.hosting.policy_opening import open_policy
from roboirg.runs.job_instruction import INSTALLED
from roboirg.runs.play.rollout import PlayJob
from roboirg.runs.run.workers import POLL_S, Worker
from roboirg.tasks.splits.private_splits import use_salt

KEY_S = 1.0
"""How long a client of a machine's hosts may take to send its key."""
MOST_WITHOUT_KEY = 64
"""Clients that may take that time side by side."""

_PID_SUFFIX = ".pid"
"""Of empty files named after the processes of a run on a machine."""

_INSTALLED = INSTALLED._replace(package_version=__version__)


@dataclass(frozen=True)
class MachineVersions:
    """What must be the same on every machine, or records of one run would differ.

    Attributes:
        policies: of the run, as they were opened on the machine.
        installed: of the package there, its environment and its language.
    """

    policies: tuple[PolicyRef, ...]
    installed: Versions = _INSTALLED

    def difference(self, there: MachineVersions) -> str | None:
        """Return in what another machine differs from this one, in words; None if in nothing.

        Only the first difference is named. A policy whose version is not known here may have any.
        """
        for what, mine, theirs in self.installed.differences(there.installed):
            return f"the {what} is {theirs} there and {mine} here"
        for policy, other in zip(self.policies, there.policies, strict=True):
            for what, mine, theirs in policy.versions.differences(other.versions):
                if mine != UNKNOWN_VERSION:
                    return f"the {what} of {policy.spec} is {theirs} there and {mine} here"
        return None


class HostAddress(NamedTuple):
    """Where the policy hosts of a machine listen, for other actors there.

    Attributes:
        path: of the socket.
        key: proves that a client belongs to the run; policies do not know it.
    """

    path: str
    key: bytes

    def connect(self) -> socket.socket:
        """Return a new connection to the machine's policy hosts, with the key already sent."""
        line = socket.socket(socket.AF_UNIX)
        line.connect(self.path)
        line.sendall(self.key)
        return line


class CheckedMachine(NamedTuple):
    """What an agent reports of its machine.

    Attributes:
        fault: why the machine cannot play, in words; None if it can.
        folder: for temporary files of the run, removed at its end.
        hosts: where the policy hosts listen; None if the run needs none.
    """

    fault: str | None
    folder: Path
    hosts: HostAddress | None = None


class MachineAgent:
    """Actor that checks a machine and holds its policy hosts; all workers there use them.

    Args:
        folder: for temporary files; an earlier agent there and its workers are killed, and their
            files go.
        settings: of the policy hosts; None if the run needs none.
    """

    def __init__(self, folder: Path, settings: HostSettings | None) -> None:
        # In a folder of another user the numbers could be those of any process.
        if folder.is_dir() and folder.lstat().st_uid == os.getuid():
            for pid_file in folder.glob(f"[0-9]*{_PID_SUFFIX}"):
                self.end(int(pid_file.stem))  # Ray does not kill what is frozen
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(mode=0o700)
        _register(folder)
        self._folder = folder
        self._settings = settings
        self._address: HostAddress | None = None
        if settings is None:
            return
        self._pool = HostPool(settings)
        path = str(folder / "hosts")
        self._address = HostAddress(path, secrets.token_bytes(32))
        self._door = socket.socket(socket.AF_UNIX)
        self._door.bind(path)
        self._door.listen()
        threading.Thread(target=self._open_lines, args=(self._address.key,), daemon=True).start()

    def check(self, versions: MachineVersions) -> CheckedMachine:
        """Return whether this machine can play: its policies load, and versions are as expected.

        Args:
            versions: those of the driver, the process that started the run.
        """
        try:
            policies = []
            for policy in versions.policies:
                named = read_policy(policy.spec, policy.name)
                policies.append(open_policy(named, settings=self._settings))
            fault = versions.difference(MachineVersions(tuple(policies)))
        except RoboIRGError as error:
            fault = one_line(error)
        return CheckedMachine(fault, self._folder, self._address)

    def beat(self) -> float:
        """Return 0: this process is alive."""
        return 0.0

    def end(self, pid: int) -> None:
        """Kill a process of this machine that does not answer."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)

    def close(self) -> None:
        """End the policies' processes on this machine, and remove the files of the run."""
        if self._address is not None:
            self._door.close()
            self._pool.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _open_lines(self, key: bytes) -> None:
        """Accept connections to the policy hosts of this machine until their socket is closed.

        Each is admitted in a thread of its own, so that none waits for another that sends nothing.
        Of those that have not sent the key yet, there are `MOST_WITHOUT_KEY` at most; more wait in
        the socket.
        """
        places = threading.BoundedSemaphore(MOST_WITHOUT_KEY)
        while True:
            places.acquire()
            try:
                line, _ = self._door.accept()
            except OSError:
                return
            threading.Thread(target=self._admit, args=(line, key, places), daemon=True).start()

    def _admit(self, line: socket.socket, key: bytes, places: threading.BoundedSemaphore) -> None:
        """Serve a new connection if it sends the key of the run within `KEY_S` seconds.

        Others are disconnected, as they may be of another user.

        Args:
            line: the connection.
            key: that it must send.
            places: of connections without the key; that of this one is released.
        """
        line.settimeout(KEY_S)
        has_key = False
        with contextlib.suppress(OSError):
            has_key = secrets.compare_digest(line.recv(len(key)), key)
        places.release()
        if has_key:
            line.settimeout(None)
            self._pool.serve(line)
        else:
            line.close()


class RemoteResult(NamedTuple):
    """Reply of a remote worker.

    Attributes:
        record: of the job; None if nothing can be played there.
        fault: why not, in words.
        files: contents of the videos and posters by path relative to the run's folder.
    """

    record: Record | None
    fault: str = ""
    files: Mapping[str, bytes] = {}


class RemoteWorker:
    """Actor that plays jobs on a machine of the cluster and returns videos as bytes.

    Args:
        play: plays one job.
        episode_timeout_s: how long an episode may take.
        salt: of the private split, if one is known.
        machine: that was found fit.
    """

    def __init__(
        self, play: PlayJob, episode_timeout_s: float, salt: str | None, machine: CheckedMachine
    ) -> None:
        if salt is not None:
            use_salt(salt)
        _register(machine.folder)
        self._folder = Path(tempfile.mkdtemp(dir=machine.folder))
        self._play = play.in_folder(self._folder) if hasattr(play, "in_folder") else play
        self._connect = None if machine.hosts is None else machine.hosts.connect
        self._episode_timeout_s = episode_timeout_s
        self._worker: Worker | None = None
        self._playing: Worker | None = None

    def pid(self) -> int:
        """Return the number of this process as soon as it runs."""
        return os.getpid()

    def beat(self) -> float:
        """Return the seconds of the job under way, without those that it waited for its turn."""
        playing = self._playing
        return 0.0 if playing is None else playing.spent_s

    def play(self, job: Job) -> RemoteResult:
        """Play a job in a child process; return its record and the files of the episode.

        The child process is kept for the next job unless it dies. Without a record, the result has
        the reason why no job can be played on this machine.
        """
        record = None
        try:
            worker = self._worker_for(job)
            self._playing = worker
            while record is None:
                record = worker.poll(self._episode_timeout_s, POLL_S)
        except RoboIRGError as error:  # it would end every other job here, too
            return RemoteResult(None, one_line(error))
        finally:
            self._playing = None
        if worker.is_dead:
            self._worker = None
        return RemoteResult(record, files=self._taken_files())

    def _worker_for(self, job: Job) -> Worker:
        """Return the child process that plays jobs, with this one assigned; start it if needed."""
        if self._worker is None:
            self._worker = Worker(self._play, job, self._connect, limit_threads=True)
        else:
            self._worker.assign(job)
        return self._worker

    def _taken_files(self) -> dict[str, bytes]:
        """Return the bytes of the episode's files by path in the run's folder, and delete them."""
        files = {}
        for path in sorted(self._folder.rglob("*")):
            if path.is_file():
                name = path.relative_to(self._folder).as_posix()
                files[name] = path.read_bytes()
                path.unlink()
        return files


def _register(folder: Path) -> None:
    """Note this process, so that the machine's next agent ends it if it is frozen."""
    (folder / f"{os.getpid()}{_PID_SUFFIX}").touch()
