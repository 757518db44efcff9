"""All measures in the order of docs/performance.md, each with its goal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from benchmarks.draw_costs import exported_step, floor_step, physics_step, undrawn_step
from benchmarks.engine_costs import engine_time, episode_time, resume_time
from benchmarks.large_run_costs import command_memory, command_time
from benchmarks.process_costs import next_episode, process_memory, process_start
from benchmarks.remote_rates import hosted, in_process, over_loopback
from benchmarks.reset_times import cold_reset, stock_reset, video_episode, warm_reset
from benchmarks.step_times import (
    Workload,
    eager_step,
    lazy_step,
    over_the_table,
    stock_step,
    stretch,
)
from benchmarks.vector_rates import vector_rate
from benchmarks.verification_costs import verify_time
from benchmarks.worker_rates import SlowPolicy, WavingPolicy, episodes_per_hour
from roboirg.simulation.rendering.render_settings import LIGHT


@dataclass(frozen=True)
class Measure:
    """What is measured, and what it has to reach.

    Attributes:
        goal: smallest ratio; without a baseline, the largest value.
        name: what is measured.
        ours: returns seconds, or a figure in `unit`.
        baseline: returns the same for the baseline; None for measures without one.
        against: name of the baseline.
        unit: unit in tables; of a rate ("1/s", "1/h") more is better, of others less.
    """

    goal: float
    name: str
    ours: Callable[[], float]
    baseline: Callable[[], float] | None = None
    against: str = ""
    unit: str = "s"


def all_measures() -> tuple[Measure, ...]:
    """Return all measures in the order of the table; a shared baseline is one object."""
    return (*_steps(), *_resets(), *_processes(), *_workers(), *_large_runs())


def _steps() -> Iterator[Measure]:
    table = over_the_table()
    stock = partial(stock_step, table)

    def against_stock(goal: float, name: str, ours: Callable[[Workload], float]) -> Measure:
        return Measure(goal, name, partial(ours, table), stock, "stock", "ms")

    yield against_stock(7, "eager step, over the table", eager_step)
    # The arm works near the front camera, as in most long videos.
    video = stretch("VideoPlaceButton", 0, first=130)
    eager = partial(eager_step, video)
    stock_video = partial(stock_step, video)
    yield Measure(5, "eager step, as in videos", eager, stock_video, "stock", "ms")
    light = partial(eager_step, rendering=LIGHT)
    yield against_stock(12, "... light meshes, over the table", light)
    yield against_stock(70, "lazy step, 16 to a picture pair", lazy_step)
    pictures = partial(exported_step, coding="png")
    yield against_stock(5, "exported step, PNG, over the table", pictures)
    lossless = partial(exported_step, coding="lossless-video")
    yield against_stock(5, "... lossless video", lossless)
    eager = partial(eager_step, table)
    floor = partial(floor_step, table)
    yield Measure(0.8, "eager step against its floor", eager, floor, "floor", "ms")
    undrawn = partial(undrawn_step, table)
    physics = partial(physics_step, table)
    yield Measure(0.5, "step without pictures", undrawn, physics, "physics", "ms")


def _resets() -> Iterator[Measure]:
    episode = video_episode()
    stock = partial(stock_reset, episode)
    cold = partial(cold_reset, episode)
    yield Measure(4.5, "video reset, cold, all frames", cold, stock, "stock")
    on_demand = partial(cold, frames=False)
    yield Measure(30, "video reset, cold, frames on demand", on_demand, stock, "stock")
    warm = partial(warm_reset, episode)
    yield Measure(60, "video reset, warm, all frames", warm, stock, "stock")


def _processes() -> Iterator[Measure]:
    following = partial(next_episode, "ours")
    stock = partial(next_episode, "stock")
    yield Measure(15, "next episode in the same process", following, stock, "stock")
    start = partial(process_start, "ours")
    stock_start = partial(process_start, "stock")
    yield Measure(5, "process start to first observation", start, stock_start, "stock")
    remote = "steps a second of a remote policy"
    yield Measure(0.9, remote, over_loopback, in_process, "in process", "1/s")
    own_process = "steps a second of a hosted policy"
    yield Measure(0.9, own_process, hosted, in_process, "in process", "1/s")
    yield Measure(50, "run engine, of an episode", engine_time, episode_time, "episode", "ms")
    yield Measure(3, "resuming with 100,000 records", resume_time)
    yield Measure(0.7, "verifying an episode", verify_time)
    yield Measure(0.5, "memory of a process", process_memory, unit="GiB")


def _workers() -> Iterator[Measure]:
    """Yield those of a run's workers, and of Gymnasium's."""

    def against_one(goal: float, name: str, policy: type, workers: int) -> Measure:
        ours = partial(episodes_per_hour, policy, workers)
        single = partial(episodes_per_hour, policy, 1)
        return Measure(goal, f"episodes an hour of {name}", ours, single, "1 worker", "1/h")

    yield against_one(6, "16 workers, 50 ms a call", SlowPolicy, 16)
    yield against_one(1.6, "2 workers", WavingPolicy, 2)
    name = "steps a second of AsyncVectorEnv, chunks of 16"
    yield Measure(5, name, vector_rate, partial(vector_rate, 1), "chunks of 1", "1/s")


def _large_runs() -> Iterator[Measure]:
    yield Measure(5, "tables of 50,000 records, CPU", partial(command_time, "tables"))
    yield Measure(20, "merge of 50,000 records, CPU", partial(command_time, "records merge"))
    yield Measure(60, "report of 50,000 records, CPU", partial(command_time, "report"))
    yield Measure(1, "... memory", partial(command_memory, "report"), unit="GiB")
