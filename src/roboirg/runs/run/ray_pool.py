"""The driver's loop over the machines of a Ray cluster.

A machine plays once its agent has found it fit, with a worker on each of its free CPUs; one that
joins later is used, too. Whatever is lost with a worker, a machine or the network becomes an error
record, which the runner retries; a machine that loses again and again is left out.
"""

from __future__ import annotations

import functools
import secrets
import time
from collections import Counter, deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any, cast

from roboirg.core.errors import RoboIRGError
from roboirg.core.plain_text import counted
from roboirg.records.record import Job, Record
from roboirg.runs.plan.plan_sections import WorkerNeeds
from roboirg.runs.play.episode_record import lost_record
from roboirg.runs.play.rollout import EpisodeRunner, PlayJob
from roboirg.runs.run.executor import Warn
from roboirg.runs.run.ray_head import POLL_S, ClusterHead
from roboirg.runs.run.ray_machines import (
    CheckedMachine,
    MachineAgent,
    MachineVersions,
    RemoteResult,
    RemoteWorker,
)
from roboirg.tasks.splits.private_splits import known_salt

LOOK_S = 2.0
"""How often the cluster is asked for its machines."""
BEAT_S = 10.0
"""How often a process is asked whether it is alive."""
SILENCE_S = 60.0
"""After this time without an answer a process is killed."""
OVERTIME_S = 30.0
"""How much longer than the time limit of an episode its worker may take."""
WAIT_S = 10.0
"""How long a run waits for CPUs before the user is warned."""
NO_CPU_TIMEOUT_S = 300.0
"""How long a cluster may have no free CPU before the run stops."""
CLOSE_S = 10.0
"""How long the agents of all machines may take to end before they are killed."""
MAX_LOSSES = 3
"""Losses in a row, for each of its workers, after which a machine is left out."""


@dataclass(eq=False, kw_only=True)
class _Watched:
    """An actor of Ray that must answer now and then.

    Attributes:
        actor: the handle; None for an agent that has not been started or was lost.
        heard_at: when it last answered, seconds of the monotonic clock.
        question: the pending call that asks whether it is alive; None if it was not asked.
    """

    actor: Any = None
    heard_at: float = field(default_factory=time.monotonic)
    question: Any = None


@dataclass(eq=False, kw_only=True)
class _Machine(_Watched):
    """A machine of the cluster, and its agent.

    Attributes:
        node: Ray's number of the machine.
        name: for the user.
        slots: how many workers it has room for.
        checked: what its agent reported; None while the check is under way.
        losses: what was lost there in a row.
        fault: why it is left out, in words; None if it is not.
    """

    node: str
    name: str
    slots: int
    checked: CheckedMachine | None = None
    losses: int = 0
    fault: str | None = None

    @property
    def is_fit(self) -> bool:
        """Whether workers may start there."""
        return self.checked is not None and self.fault is None


@dataclass(eq=False, kw_only=True)
class _Worker(_Watched):
    """A worker on a machine.

    Attributes:
        machine: where it is.
        pid: number of its process; None while it waits for a CPU or starts.
        job: that it plays; None if it is idle.
        started: when it was started, seconds of the monotonic clock.
    """

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
        self._ray = ray
        self._play = play
        self._episode_timeout_s = episode_timeout_s
        self._most = most
        self._needs = needs
        self._warn = warn
        self._remote = functools.partial(
            ray.remote, runtime_env=environment, max_restarts=0, concurrency_groups={"beat": 1}
        )
        self._head = ClusterHead(ray.get_runtime_context().gcs_address)
        self._run = secrets.token_hex(8)

        self._machines: dict[str, _Machine] = {}  # by node
        self._workers: list[_Worker] = []
        # By pending call: the worker that is called, or the machine whose agent is.
        self._calls: dict[Any, _Worker | _Machine] = {}
        self._lost_on: dict[Job, set[str]] = {}  # the nodes where a job was lost

        now = time.monotonic()
        self._listed_at = 0.0  # for machines
        self._played_at = now  # something
        self._warned_at = now  # the user, that nothing is played

    def play_all(self, jobs: deque[Job]) -> Iterator[Record]:
        """Play jobs on the machines of the cluster; yield one record for each as they finish.

        Each round looks for machines, starts workers, gives them jobs, and receives what has ended.
        While the head of the cluster does not answer, all of that waits: calls of Ray would block.
        """
        policies = dict.fromkeys(job.ref for job in jobs if job.ref is not None)
        versions = MachineVersions(tuple(policies))
        while jobs or self._busy():
            self._head.wait(len(jobs))
            self._look_for_machines(versions)
            self._start_workers(len(jobs))
            self._assign(jobs)
            for finished_call in self._finished():
                yield from self._receive(finished_call, jobs)
            yield from self._end_silent()
            self._check_waiting(len(jobs))

    def close(self) -> None:
        """Kill all workers, and let the machines' agents remove their files before they are killed.

        Nothing is done if the head of the cluster does not answer, as calls of Ray would block.
        """
        if not self._head.answers():
            return
        for worker in self._workers:
            self._ray.kill(worker.actor)
        machines = self._machines.values()
        agents = [machine.actor for machine in machines if machine.actor is not None]
        closing = [agent.close.remote() for agent in agents]
        if closing:
            self._ray.wait(closing, num_returns=len(closing), timeout=CLOSE_S)
        for agent in agents:
            self._ray.kill(agent)

    def _busy(self) -> int:
        """Return how many workers play."""
        return sum(worker.job is not None for worker in self._workers)

    def _finished(self) -> list[Any]:
        """Return calls of actors that have finished; waits `POLL_S` seconds for one at most."""
        if not self._calls:
            time.sleep(POLL_S)
            return []
        finished: list[Any]
        finished, _ = self._ray.wait(list(self._calls), num_returns=1, timeout=POLL_S)
        return finished

    def _look_for_machines(self, versions: MachineVersions) -> None:
        """Update the known machines of the cluster, every `LOOK_S` seconds.

        Those that have left get a fault. On those that have joined, or whose agent was lost, an
        agent is started, which checks that the machine can play.

        Args:
            versions: of package and policies, which a machine must have.
        """
        now = time.monotonic()
        if now - self._listed_at < LOOK_S or not self._head.answers():
            return
        self._listed_at = now
        alive = {node["NodeID"]: node for node in self._ray.nodes() if node["Alive"]}
        for machine in self._machines.values():
            if machine.node not in alive and machine.fault is None:
                machine.fault = "it has left the cluster"
        self._check_any_left()
        for number, node in alive.items():
            slots = self._needs.slots(node)
            if number not in self._machines and slots:
                self._machines[number] = _Machine(
                    node=number, name=_display_name(node), slots=slots
                )
        for machine in self._machines.values():
            if machine.actor is None and machine.fault is None:
                self._start_agent(machine, versions)

    def _start_agent(self, machine: _Machine, versions: MachineVersions) -> None:
        """Start the agent of a machine, an actor that takes no CPU, and let it check the machine.

        Args:
            machine: where the agent runs.
            versions: of package and policies, which the machine must have.
        """
        make = self._remote(num_cpus=0, scheduling_strategy=_only_on(machine))(MachineAgent)
        # In /tmp, because the path of a socket may have 100 characters only.
        name = f"roboirg-{self._run}-{machine.node[:8]}"
        folder = Path("/tmp") / name  # noqa: S108 - made with mode 700
        machine.actor = make.remote(folder, getattr(self._play, "hosting", None))
        machine.heard_at = time.monotonic()
        machine.question = None
        self._calls[machine.actor.check.remote(versions)] = machine

    def _start_workers(self, waiting: int) -> None:
        """Start as many workers as jobs need, each on the machine with the fewest.

        Args:
            waiting: number of jobs that no worker plays yet.
        """
        now = time.monotonic()
        wanted = waiting + self._busy()
        if self._most is not None:
            wanted = min(wanted, self._most)
        for worker in self._workers:
            # A worker counts once it has a process, or while it was just started. One that waits
            # longer for a CPU does not, so that another machine may get a worker in its place.
            if worker.pid or now < worker.started + WAIT_S:
                wanted -= 1
        for _ in range(wanted):
            machine = self._emptiest_machine()
            if machine is None:
                return
            make = self._remote(**self._needs.options(), scheduling_strategy=_only_on(machine))
            actor = make(RemoteWorker).remote(
                self._play, self._episode_timeout_s, known_salt(), machine.checked
            )
            worker = _Worker(actor=actor, machine=machine)
            self._workers.append(worker)
            self._calls[actor.pid.remote()] = worker

    def _emptiest_machine(self) -> _Machine | None:
        """Return the fit machine with the fewest workers; None if none has room for one more."""
        counts = Counter(worker.machine.node for worker in self._workers)
        with_room = [
            machine
            for machine in self._machines.values()
            if machine.is_fit and counts[machine.node] < machine.slots
        ]
        return min(with_room, key=lambda there: (counts[there.node], there.node), default=None)

    def _assign(self, jobs: deque[Job]) -> None:
        """Give each idle worker the first job that may be played there.

        A job that was lost on a machine is not played there again if there are other machines.
        """
        for worker in self._workers:
            if worker.pid is None or worker.job is not None:
                continue
            machine = worker.machine
            has_others = any(other.pid and other.machine is not machine for other in self._workers)
            for place, job in enumerate(jobs):
                if has_others and machine.node in self._lost_on.get(job, ()):
                    continue
                del jobs[place]
                worker.job = job
                worker.heard_at = self._played_at = self._warned_at = time.monotonic()
                self._calls[worker.actor.play.remote(job)] = worker
                break

    def _receive(self, call: object, jobs: deque[Job]) -> Iterator[Record]:
        """Handle the reply of a finished call; yield the records that come of it.

        The reply is a sign of life, a machine's check, the number of a worker's process, or the
        result of a job. If the call failed, its actor was lost.

        Args:
            call: Ray's reference of the call.
            jobs: the queue; gets those back that cannot be played there.
        """
        called = self._calls.pop(call, None)  # it may have been given up meanwhile
        if called is None:
            return
        try:
            reply = self._ray.get(call)
        except self._ray.exceptions.RayError as error:
            yield from self._lose(called, _reason(error))
            return
        if call == called.question:  # the reply is the seconds that its job has taken
            called.heard_at = time.monotonic()
            called.question = None
            if reply > self._episode_timeout_s + OVERTIME_S:
                reason = f"it did not end an episode that took {reply:.0f} s"
                yield from self._lose(called, reason)
        elif isinstance(called, _Machine):
            called.checked = reply
            if reply.fault is not None:
                self._leave_out(called, reply.fault)
        elif called.pid is None:
            called.pid = reply
            started = sum(worker.pid is not None for worker in self._workers)
            if self._most is not None and started > self._most:
                self._end(called)  # others have taken its place while it waited
        else:
            yield from self._finish(called, reply, jobs)
        # A machine that was left out gets no more jobs, so its workers end once they are idle.
        if isinstance(called, _Worker) and called.job is None and called.machine.fault is not None:
            self._end(called)

    def _finish(self, worker: _Worker, reply: RemoteResult, jobs: deque[Job]) -> Iterator[Record]:
        """Handle the result of a job that a worker has played: store its files, yield its record.

        Without a record the machine cannot play: it gets no more jobs, and the job returns to the
        queue. An error that may be the machine's fault counts as a loss there.

        Args:
            worker: that has played.
            reply: the result.
            jobs: the queue.
        """
        self._calls.pop(worker.question, None)  # it was about this job
        worker.question = None
        job = cast("Job", worker.job)
        worker.job = None
        machine = worker.machine
        if reply.record is None:
            jobs.appendleft(job)
            self._leave_out(machine, reply.fault)
            return
        for name, data in reply.files.items():
            path = cast("EpisodeRunner", self._play).folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        yield reply.record
        if reply.record.error not in ("infrastructure", "environment"):
            machine.losses = 0
            return
        # Where there is no other machine, errors of episodes are not the machine's.
        others = [other for other in self._machines.values() if other is not machine]
        if any(other.is_fit for other in others):
            self._count_loss(machine, str(reply.record.cause))
            self._lost_on.setdefault(job, set()).add(machine.node)

    def _lose(self, lost: _Worker | _Machine, reason: str) -> Iterator[Record]:
        """Give up a lost worker, or all workers of a machine whose agent was lost.

        Yields:
            A record of an error for each job that they played.

        Args:
            lost: the worker, or the machine whose agent was lost.
            reason: in words.
        """
        machine = lost.machine if isinstance(lost, _Worker) else lost
        workers = [worker for worker in self._workers if lost in (worker, worker.machine)]
        for worker in workers:
            self._end(worker)
        self._count_loss(machine, reason)
        if lost is machine:
            self._forget_calls(machine)
            self._kill(machine.actor)
            machine.actor = None
            machine.checked = None
        for worker in workers:
            if worker.job is not None:
                self._lost_on.setdefault(worker.job, set()).add(machine.node)
                where = f"the machine or process that played it was lost ({machine.name}, {reason})"
                yield lost_record(worker.job, "infrastructure", where)

    def _end(self, worker: _Worker) -> None:
        """Kill a worker and forget it; one that is frozen is killed by its machine's agent."""
        if worker not in self._workers:
            return
        self._workers.remove(worker)
        self._forget_calls(worker)
        self._kill(worker.actor)
        agent = worker.machine.actor
        if worker.pid is not None and agent is not None and self._head.answers():
            # Ray does not kill what is frozen.
            agent.end.options(concurrency_group="beat").remote(worker.pid)

    def _forget_calls(self, called: _Worker | _Machine) -> None:
        """Wait no longer for the calls of an actor."""
        for call, owner in tuple(self._calls.items()):
            if owner is called:
                del self._calls[call]

    def _kill(self, actor: Any) -> None:  # noqa: ANN401 - a handle of Ray
        """Let Ray kill an actor, if its head answers."""
        if self._head.answers():
            self._ray.kill(actor)

    def _count_loss(self, machine: _Machine, reason: str) -> None:
        """Count that something was lost on a machine; leave it out after too many in a row."""
        machine.losses += 1
        most = MAX_LOSSES
        if machine.checked is not None:  # it may have workers, of which each may be lost as often
            most *= machine.slots
        if machine.losses >= most:
            self._leave_out(machine, f"lost {machine.losses} times in a row, at last {reason}")

    def _leave_out(self, machine: _Machine, fault: str) -> None:
        """Give a machine no more jobs, because of a fault, and warn the user; idle workers end.

        Raises:
            RoboIRGError: it was the last machine.
        """
        if machine.fault is not None:
            return
        fault = fault.rstrip(".")
        machine.fault = fault
        for worker in tuple(self._workers):
            if worker.machine is machine and worker.job is None:
                self._end(worker)
        self._warn(f"The machine {machine.name} of the Ray cluster is left out: {fault}.")
        self._check_any_left()

    def _check_any_left(self) -> None:
        """Raise if all machines that are known are left out."""
        faults = {machine.name: machine.fault for machine in self._machines.values()}
        if faults and None not in faults.values():
            shown = "; ".join(f"{name}: {fault}" for name, fault in faults.items())
            raise RoboIRGError(f"No machine of the Ray cluster can play ({shown}).")

    def _watched(self) -> list[_Machine | _Worker]:
        """Return what must give signs of life: the agents of all usable machines, busy workers."""
        watched: list[_Machine | _Worker] = []
        for machine in self._machines.values():
            if machine.fault is None and machine.actor is not None:
                watched.append(machine)
        watched += [worker for worker in self._workers if worker.job is not None]
        return watched

    def _end_silent(self) -> Iterator[Record]:
        """Ask agents and busy workers for a sign of life; give up those that do not answer.

        A process is asked `BEAT_S` seconds after its last answer, and given up after `SILENCE_S`.

        Yields:
            A record of an error for each job that was lost.
        """
        now = time.monotonic()
        for process in self._watched():
            if isinstance(process, _Worker) and process not in self._workers:
                continue  # it was lost with its machine's agent
            silence_s = now - process.heard_at
            if process.question is None and silence_s > BEAT_S:
                process.question = process.actor.beat.options(concurrency_group="beat").remote()
                self._calls[process.question] = process
            elif silence_s > SILENCE_S:
                answered, _ = self._ray.wait([process.question], timeout=0)
                if not answered:
                    reason = f"its process has not answered for {SILENCE_S:g} s"
                    yield from self._lose(process, reason)

    def _check_waiting(self, left: int) -> None:
        """Warn the user once nothing has been played for `WAIT_S` seconds, and later raise.

        Args:
            left: number of episodes that were not played.

        Raises:
            RoboIRGError: nothing has been played for `NO_CPU_TIMEOUT_S` seconds.
        """
        now = time.monotonic()
        if self._busy():
            self._played_at = now
            self._warned_at = now
        if now - self._played_at > NO_CPU_TIMEOUT_S:
            raise RoboIRGError(
                f"The Ray cluster had no free CPU for {NO_CPU_TIMEOUT_S:g} s; run the same "
                f"command again to play the remaining {counted(left, 'episode')}."
            )
        if now - self._warned_at <= WAIT_S:
            return
        self._warned_at = now + NO_CPU_TIMEOUT_S  # no second warning before the run stops
        machines = self._machines.values()
        checking = [machine.name for machine in machines if machine.checked is None]
        if checking:
            self._warn(f"Waiting for the check of {', '.join(checking)}.")
            return
        fit = [machine for machine in machines if machine.is_fit]
        slots = sum(machine.slots for machine in fit)
        where = f"{counted(slots, 'worker')} on {counted(len(fit), 'machine')}"
        self._warn(f"Waiting for a free CPU: the Ray cluster has room for {where}.")


def _only_on(machine: _Machine) -> Any:  # noqa: ANN401 - of Ray
    """Return the strategy of Ray that starts an actor on a machine."""
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    return NodeAffinitySchedulingStrategy(machine.node, soft=False)


def _display_name(node: Mapping[str, Any]) -> str:
    """Return the name of a machine, with a part of its number as several may be on one host."""
    return f"{node.get('NodeManagerHostname', 'machine')} ({node['NodeID'][:8]})"


def _reason(error: BaseException) -> str:
    """Return what Ray says of a loss; the last line of its message is the exception itself."""
    kind = type(error).__name__
    message = str(error).strip()
    if not message:
        return kind
    return f"{kind}: {message.splitlines()[-1].strip()}"
