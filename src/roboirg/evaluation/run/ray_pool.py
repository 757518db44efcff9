"""The driver's loop over the machines of a Ray cluster.

A machine plays once its agent has found it fit, with a worker on each of its free CPUs; one that
joins later is used, too. Whatever is lost with a worker, a machine or the network becomes an error
record, which the runner retries; a machine that loses again and again is left out.
"""

from __future__ import annotations

import functools
import secrets
import socket
import time
from collections import Counter, deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any, cast

from roboirg.core.errors import RoboIRGError
from roboirg.core.plain_text import counted
from roboirg.evaluation.plan.plan_sections import WorkerNeeds
from roboirg.evaluation.play.episode_record import lost_record
from roboirg.evaluation.play.rollout import EpisodeRunner, PlayJob
from roboirg.evaluation.records.record import Job, Record
from roboirg.evaluation.run.executor import Warn
from roboirg.evaluation.run.ray_machines import (
    CheckedMachine,
    MachineAgent,
    MachineVersions,
    RemoteResult,
    RemoteWorker,
)
from roboirg.tasks.splits.private_splits import known_salt

POLL_S = 1.0
LOOK_S = 2.0
"""How often the cluster is asked for its machines."""
BEAT_S = 10.0
"""How often a process is asked whether it is alive."""
SILENCE_S = 60.0
"""After this time without an answer a process is killed."""
LATE_S = 30.0
"""How much longer than the time limit of an episode its worker may take."""
WAIT_S = 10.0
"""How long a run waits for CPUs before the user is warned."""
NO_CPU_TIMEOUT_S = 300.0
"""How long a cluster may have no free CPU before the run stops."""
HEAD_LOST_S = 20.0
"""How long the head of the cluster may not answer; after a minute Ray would end this process."""
CLOSE_S = 10.0
"""How long the agents of all machines may take to end before they are killed."""
MAX_LOSSES = 3
"""Losses in a row, for each of its workers, after which a machine is left out."""


@dataclass(eq=False, kw_only=True)
class _Watched:
    """An actor: when it was heard, and the question that it has not answered."""

    actor: Any = None
    heard: float = field(default_factory=time.monotonic)
    question: Any = None


@dataclass(eq=False, kw_only=True)
class _Machine(_Watched):
    """A machine of the cluster and its agent; without `checked`, its check is under way."""

    node: str
    name: str
    slots: int
    checked: CheckedMachine | None = None
    losses: int = 0
    fault: str | None = None

    @property
    def is_fit(self) -> bool:
        return self.checked is not None and self.fault is None


@dataclass(eq=False, kw_only=True)
class _Worker(_Watched):
    """A worker; without `pid`, it waits for a CPU or starts."""

    machine: _Machine
    pid: int | None = None
    job: Job | None = None
    started: float = field(default_factory=time.monotonic)


class RayPool:
    """The machines of a cluster, their workers and the current jobs.

    Args:
        ray: the module.
        play: plays one job.
        episode_timeout_s: how long an episode may take.
        most: workers at a time; None for as many as fit on the cluster.
        needs: what a worker reserves.
        environment: Ray's runtime environment of the actors.
        warn: shows what the user should know.
    """

    def __init__(
        self,
        ray: ModuleType,
        play: PlayJob,
        episode_timeout_s: float,
        most: int | None,
        needs: WorkerNeeds,
        environment: Mapping[str, Any],
        warn: Warn,
    ) -> None:
        self._ray, self._play, self._episode_timeout_s = ray, play, episode_timeout_s
        self._most, self._needs, self._warn = most, needs, warn
        self._remote = functools.partial(
            ray.remote, runtime_env=environment, max_restarts=0, concurrency_groups={"beat": 1}
        )
        self._machines: dict[str, _Machine] = {}
        # By pending call: the worker that is called, or the machine whose agent is.
        self._calls: dict[Any, _Worker | _Machine] = {}
        self._workers: list[_Worker] = []
        self._run = secrets.token_hex(8)
        self._lost_at: dict[Job, set[str]] = {}
        self._looked = 0.0
        self._active = self._warned = self._reached = time.monotonic()
        self._address = ray.get_runtime_context().gcs_address

    def play_all(self, jobs: deque[Job]) -> Iterator[Record]:
        """Yield one record for each job as they finish."""
        refs = dict.fromkeys(job.ref for job in jobs if job.ref is not None)
        versions = MachineVersions.expected(tuple(refs))
        while jobs or self._busy():
            if time.monotonic() - self._reached > POLL_S and not self._is_reachable():
                self._check_head(len(jobs))
                continue
            self._look_for_machines(versions)
            self._start_workers(len(jobs))
            self._assign(jobs)
            for reference in self._finished():
                yield from self._receive(reference, jobs)
            yield from self._end_silent()
            self._check_waiting(len(jobs))

    def close(self) -> None:
        """Kill all workers, and end the agents."""
        if not self._is_reachable():
            return
        for worker in self._workers:
            self._ray.kill(worker.actor)
        agents = [one.actor for one in self._machines.values() if one.actor is not None]
        closing = [agent.close.remote() for agent in agents]
        if closing:
            self._ray.wait(closing, num_returns=len(closing), timeout=CLOSE_S)
        for agent in agents:
            self._ray.kill(agent)

    def _busy(self) -> int:
        return sum(worker.job is not None for worker in self._workers)

    def _finished(self) -> list[Any]:
        """Wait for a call to end; return those that have."""
        if not self._calls:
            time.sleep(POLL_S)
            return []
        ready: list[Any] = self._ray.wait(list(self._calls), num_returns=1, timeout=POLL_S)[0]
        return ready

    def _is_reachable(self) -> bool:
        """Whether the head answers: without it Ray's calls block, and then end this process."""
        host, _, port = self._address.rpartition(":")
        try:
            socket.create_connection((host, int(port)), timeout=LOOK_S).close()
        except OSError:
            return False
        self._reached = time.monotonic()
        return True

    def _check_head(self, left: int) -> None:
        """Wait for the head; an error ends the run if it has not answered for too long."""
        if time.monotonic() - self._reached > HEAD_LOST_S:
            raise RoboIRGError(
                f"The head of the Ray cluster at {self._address} has not answered for "
                f"{HEAD_LOST_S:g} s; run the same command again to play the remaining "
                f"{counted(left, 'episode')}."
            )
        time.sleep(POLL_S)

    def _look_for_machines(self, versions: MachineVersions) -> None:
        """Start the check of machines that have joined."""
        now = time.monotonic()
        if now - self._looked < LOOK_S or not self._is_reachable():
            return
        self._looked = now
        alive = {node["NodeID"]: node for node in self._ray.nodes() if node["Alive"]}
        for name in set(self._machines) - set(alive):
            self._machines[name].fault = self._machines[name].fault or "it has left the cluster"
        self._check_any_left()
        for name, node in alive.items():
            slots = self._needs.slots(node)
            if name not in self._machines and slots:
                self._machines[name] = _Machine(node=name, name=_shown(node), slots=slots)
        for machine in self._machines.values():
            if machine.actor is None and machine.fault is None:
                self._start_agent(machine, versions)

    def _start_agent(self, machine: _Machine, versions: MachineVersions) -> None:
        """Start the agent of a machine, and its check of the machine."""
        actor = self._remote(num_cpus=0, scheduling_strategy=_there(machine))(MachineAgent)
        # In /tmp, because the path of a socket may have 100 characters only.
        folder = Path("/tmp") / f"roboirg-{self._run}-{machine.node[:8]}"  # noqa: S108 - made with mode 700
        machine.actor = actor.remote(folder, getattr(self._play, "hosting", None))
        machine.heard, machine.question = time.monotonic(), None
        self._calls[machine.actor.check.remote(versions)] = machine

    def _start_workers(self, waiting: int) -> None:
        """Start workers where there is room, first on machines that have few."""
        now, wanted = time.monotonic(), waiting + self._busy()
        # Those that wait for a CPU which others use do not keep the run from other machines.
        here = [one for one in self._workers if one.pid or now < one.started + WAIT_S]
        for _ in range(min(self._most or wanted, wanted) - len(here)):
            counts = Counter(worker.machine.node for worker in self._workers)
            free = [
                (counts[node], node)
                for node, machine in self._machines.items()
                if machine.is_fit and counts[node] < machine.slots
            ]
            if not free:
                return
            machine = self._machines[min(free)[1]]
            remote = self._remote(**self._needs.options(), scheduling_strategy=_there(machine))
            actor = remote(RemoteWorker).remote(
                self._play, self._episode_timeout_s, known_salt(), machine.checked
            )
            self._workers.append(_Worker(actor=actor, machine=machine))
            self._calls[actor.pid.remote()] = self._workers[-1]

    def _assign(self, jobs: deque[Job]) -> None:
        """Give jobs to idle workers, lost ones to those of another machine."""
        for worker in self._workers:
            if worker.pid is None or worker.job is not None:
                continue
            node = worker.machine.node
            others = any(one.pid and one.machine is not worker.machine for one in self._workers)
            for place, job in enumerate(jobs):
                if not others or node not in self._lost_at.get(job, ()):
                    del jobs[place]
                    worker.job = job
                    self._active = self._warned = worker.heard = time.monotonic()
                    self._calls[worker.actor.play.remote(job)] = worker
                    break

    def _receive(self, reference: object, jobs: deque[Job]) -> Iterator[Record]:
        """Take the reply of a finished call."""
        called = self._calls.pop(reference, None)  # it may have been given up meanwhile
        if called is None:
            return
        try:
            reply = self._ray.get(reference)
        except self._ray.exceptions.RayError as error:
            yield from self._lose(called, _reason(error))
            return
        if isinstance(reply, float):
            called.heard, called.question = time.monotonic(), None
            if reply > self._episode_timeout_s + LATE_S:
                reason = f"it did not end an episode that took {reply:.0f} s"
                yield from self._lose(called, reason)
        elif isinstance(called, _Machine):
            called.checked = reply
            if reply.fault is not None:
                self._leave_out(called, reply.fault)
        elif isinstance(reply, RemoteResult):
            yield from self._finish(called, reply, jobs)
        else:
            called.pid = reply
            started = sum(worker.pid is not None for worker in self._workers)
            if self._most is not None and started > self._most:
                self._end(called)  # others have taken its place while it waited
        if isinstance(called, _Worker) and called.job is None and called.machine.fault is not None:
            self._end(called)

    def _finish(self, worker: _Worker, reply: RemoteResult, jobs: deque[Job]) -> Iterator[Record]:
        """Store the files of a record, and yield it."""
        self._calls.pop(worker.question, None)  # it was about this job
        job, worker.job, worker.question = cast("Job", worker.job), None, None
        if reply.record is None:
            jobs.appendleft(job)
            self._leave_out(worker.machine, reply.fault)
            return
        for name, data in reply.files.items():
            path = cast("EpisodeRunner", self._play).folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        yield reply.record
        if reply.record.error not in ("infrastructure", "environment"):
            worker.machine.losses = 0
        elif any(one.is_fit for one in self._machines.values() if one is not worker.machine):
            # Where there is no other machine, errors of episodes are not the machine's.
            self._count_loss(worker.machine, str(reply.record.cause))
            self._lost_at.setdefault(job, set()).add(worker.machine.node)

    def _lose(self, lost: _Worker | _Machine, reason: str) -> Iterator[Record]:
        """Give up a worker, or a machine's agent with all workers there; yield their errors."""
        machine = lost if isinstance(lost, _Machine) else lost.machine
        workers = [one for one in self._workers if lost in (one, one.machine)]
        for worker in workers:
            self._end(worker)
        self._count_loss(machine, reason)
        if lost is machine:
            self._calls = {one: called for one, called in self._calls.items() if called is not lost}
            self._kill(machine.actor)
            machine.actor, machine.checked = None, None
        for worker in workers:
            if worker.job is not None:
                self._lost_at.setdefault(worker.job, set()).add(machine.node)
                where = f"the machine or process that played it was lost ({machine.name}, {reason})"
                yield lost_record(worker.job, "infrastructure", where)

    def _end(self, worker: _Worker) -> None:
        """Kill a worker, even one that is frozen."""
        if worker not in self._workers:
            return
        self._workers.remove(worker)
        self._calls = {one: called for one, called in self._calls.items() if called is not worker}
        self._kill(worker.actor)
        if worker.pid is not None and worker.machine.actor is not None and self._is_reachable():
            end = worker.machine.actor.end.options(concurrency_group="beat")
            end.remote(worker.pid)  # Ray does not kill what is frozen

    def _kill(self, actor: Any) -> None:  # noqa: ANN401 - a handle of Ray
        if self._is_reachable():
            self._ray.kill(actor)

    def _count_loss(self, machine: _Machine, reason: str) -> None:
        """Count a loss in a row; leave the machine out if there are too many."""
        machine.losses += 1
        if machine.losses >= MAX_LOSSES * (1 if machine.checked is None else machine.slots):
            self._leave_out(machine, f"lost {machine.losses} times in a row, at last {reason}")

    def _leave_out(self, machine: _Machine, fault: str) -> None:
        """Use a machine no more; an error ends the run if it was the last one."""
        if machine.fault is not None:
            return
        machine.fault = fault = fault.rstrip(".")
        for worker in tuple(self._workers):
            if worker.machine is machine and worker.job is None:
                self._end(worker)
        self._warn(f"The machine {machine.name} of the Ray cluster is left out: {fault}.")
        self._check_any_left()

    def _check_any_left(self) -> None:
        """Stop if machines are left out and no other is there."""
        faults = {one.name: one.fault for one in self._machines.values()}
        if faults and None not in faults.values():
            shown = "; ".join(f"{name}: {fault}" for name, fault in faults.items())
            raise RoboIRGError(f"No machine of the Ray cluster can play ({shown}).")

    def _end_silent(self) -> Iterator[Record]:
        """Ask agents and busy workers whether they are alive; give up those that do not answer."""
        now = time.monotonic()
        asked: list[_Machine | _Worker] = [
            one for one in self._machines.values() if one.actor is not None and one.fault is None
        ]
        asked += [worker for worker in self._workers if worker.job is not None]
        for one in asked:
            if isinstance(one, _Worker) and one not in self._workers:
                continue  # it was lost with its machine's agent
            if one.question is None and now - one.heard > BEAT_S:
                one.question = one.actor.beat.options(concurrency_group="beat").remote()
                self._calls[one.question] = one
            elif now - one.heard > SILENCE_S and not self._ray.wait([one.question], timeout=0)[0]:
                reason = f"its process has not answered for {SILENCE_S:g} s"
                yield from self._lose(one, reason)

    def _check_waiting(self, left: int) -> None:
        """Warn the user while nothing is played, and stop if that takes too long."""
        now = time.monotonic()
        if self._busy():
            self._active = self._warned = now
        if now - self._active > NO_CPU_TIMEOUT_S:
            raise RoboIRGError(
                f"The Ray cluster had no free CPU for {NO_CPU_TIMEOUT_S:g} s; run the same "
                f"command again to play the remaining {counted(left, 'episode')}."
            )
        if now - self._warned > WAIT_S:
            self._warned = now + NO_CPU_TIMEOUT_S
            checking = [one.name for one in self._machines.values() if one.checked is None]
            if checking:
                self._warn(f"Waiting for the check of {', '.join(checking)}.")
            else:
                fit = [one for one in self._machines.values() if one.is_fit]
                slots = sum(one.slots for one in fit)
                where = f"{counted(slots, 'worker')} on {counted(len(fit), 'machine')}"
                self._warn(f"Waiting for a free CPU: the Ray cluster has room for {where}.")


def _there(machine: _Machine) -> Any:  # noqa: ANN401 - of Ray
    """Return the strategy of Ray that starts an actor on a machine."""
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    return NodeAffinitySchedulingStrategy(machine.node, soft=False)


def _shown(node: Mapping[str, Any]) -> str:
    """Return the name of a machine, with a part of its number as several may be on one host."""
    return f"{node.get('NodeManagerHostname', 'machine')} ({node['NodeID'][:8]})"


def _reason(error: BaseException) -> str:
    """Return what Ray says of a loss; the last line of its message is the exception itself."""
    lines = [line.strip() for line in str(error).strip().splitlines() if line.strip()]
    return f"{type(error).__name__}: {lines[-1]}" if lines else type(error).__name__
