"""Policies in a process of their own: against the world's process, and one for many worlds."""

from __future__ import annotations

import contextlib
import os
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.bench.remote_rates import CHUNK, WavingPolicy, steps_per_second
from roboirg.core.observations import FRONT, Demonstration, Observation
from roboirg.evaluation.hosting.host_pool import HostPool, HostSettings
from roboirg.evaluation.hosting.hosted_policy import HostedPolicy
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.play.rollout import EpisodeRunner
from roboirg.evaluation.run.executor import LocalProcesses

CALL_S = 0.05
"""How long a call of the slow policy takes, whatever the number of episodes."""
MAX_STEPS = 20 * CHUNK
EPISODES = 12
"""Episodes that each worker plays, about."""
_HOUR_S = 3600
_WORKER = "multiprocessing.spawn"
"""In the command line of a process with a world."""


class SlowPolicy:
    """Swings the arm, takes batches, and thinks 50 ms about each, as a model on a GPU does."""

    cameras: ClassVar[tuple[str, ...]] = (FRONT,)
    demonstration_frames: ClassVar[str] = "none"
    version = "1"

    def begin(self, instruction: str, demonstration: Demonstration) -> WavingPolicy:
        """Return the swing of an episode."""
        state = WavingPolicy()
        state.reset(instruction, demonstration)
        return state

    def act_batch(
        self, states: Sequence[WavingPolicy], observations: Sequence[Observation]
    ) -> list[NDArray[np.floating[Any]]]:
        """Return the next sixteen actions of each episode."""
        self.think(observations)
        return [state.act(one) for state, one in zip(states, observations, strict=True)]

    def think(self, observations: Sequence[Observation]) -> None:
        """Take the time that a model takes."""
        del observations
        time.sleep(CALL_S)


class QuickPolicy(WavingPolicy):
    """Answers at once, and looks at the front picture."""

    cameras: ClassVar[tuple[str, ...]] = (FRONT,)
    demonstration_frames: ClassVar[str] = "none"


class TorchPolicy(SlowPolicy):
    """Swings the arm after a small PyTorch model on the CPU has looked at the front picture.

    Four convolutions and four layers of 2048: 17 million weights, with random values.
    """

    def __init__(self) -> None:
        import torch
        from torch import nn

        torch.manual_seed(0)
        layers: list[nn.Module] = [nn.AvgPool2d(4)]
        for inputs, outputs in ((3, 16), (16, 32), (32, 64), (64, 64)):
            layers += [nn.Conv2d(inputs, outputs, 3, stride=2, padding=1), nn.ReLU()]
        layers.append(nn.Flatten())
        for inputs, outputs in ((1024, 2048), (2048, 2048), (2048, 2048), (2048, 2048)):
            layers += [nn.Linear(inputs, outputs), nn.ReLU()]
        self._torch = torch
        self._model = nn.Sequential(*layers, nn.Linear(2048, 8 * CHUNK)).eval()

    def think(self, observations: Sequence[Observation]) -> None:
        """Ask the model about all episodes at once."""
        torch = self._torch
        pictures = torch.from_numpy(np.stack([one["front_rgb"] for one in observations]))
        with torch.inference_mode():
            self._model(pictures.permute(0, 3, 1, 2).float() / 255)


class RunCosts(NamedTuple):
    """What a run costs once all workers have started.

    Attributes:
        episodes_per_hour: of all workers together.
        processor_s: processor time of an episode, of world, host and supervisor together.
        worker_gib: memory of the largest worker; what it shares is divided among the sharers.
    """

    episodes_per_hour: float
    processor_s: float
    worker_gib: float


def hosted() -> float:
    """Return steps per second with a policy that answers at once, in a process of its own."""
    with HostPool(HostSettings()) as pool:
        spec = f"{WavingPolicy.__module__}:{WavingPolicy.__name__}"
        policy = HostedPolicy(pool.connect(), spec, 0)
        try:
            return steps_per_second(policy)
        finally:
            policy.close()


def episodes_per_hour(policy: type, workers: int) -> float:
    """Return the pace at which a number of workers plays a policy, without their start."""
    _latest[policy, workers] = _run_costs(policy, workers)
    return _latest[policy, workers].episodes_per_hour


def costs(policy: type, workers: int) -> RunCosts:
    """Return the costs of the run that was measured last, or of a new one."""
    if (policy, workers) not in _latest:
        episodes_per_hour(policy, workers)
    return _latest[policy, workers]


_latest: dict[tuple[type, int], RunCosts] = {}


def _run_costs(policy: type, workers: int) -> RunCosts:
    count = EPISODES * workers
    plan = make_plan(
        [f"{policy.__module__}:{policy.__name__}"],
        tasks="PickXtimes",
        settings="explicit",
        episodes="4",
        policy_seeds=f"0-{count // 4 - 1}",
        max_steps=MAX_STEPS,
    )
    # Without the beginning, when some workers still start, and the end, when some have no more.
    first, last = 4 * workers, count - workers
    with tempfile.TemporaryDirectory() as folder:
        runner = EpisodeRunner(Path(folder), hosting=plan.hosting)
        for number, record in enumerate(LocalProcesses(workers).run(plan.jobs(), runner), start=1):
            if record.outcome == "error":
                raise RuntimeError(f"an episode ended in an error: {record.cause}")
            if number == first:
                start, spent = time.perf_counter(), _processor_time()
            elif number == last:
                seconds, spent = time.perf_counter() - start, _processor_time() - spent
                memory = max(_memory(pid) for pid, command in _children() if _WORKER in command)
    played = last - first
    return RunCosts(_HOUR_S * played / seconds, spent / played, memory)


def _processor_time() -> float:
    """Return the processor time of this process and its children until now, s."""
    ticks = 0
    for pid in ("self", *(pid for pid, _ in _children())):
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def _memory(pid: str) -> float:
    """Return the proportional memory of a process, GiB."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return int(next(line.split()[1] for line in lines if line.startswith("Pss:"))) / 2**20


def _children() -> Iterator[tuple[str, str]]:
    """Yield the process id and the command line of each child."""
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # it has ended meanwhile
            if int((folder / "stat").read_text().rpartition(")")[2].split()[1]) == os.getpid():
                yield folder.name, (folder / "cmdline").read_text()
