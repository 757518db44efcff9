"""All measures in the order of docs/performance.md, each with its goal."""

from __future__ import annotations

from collections.abc import Callable
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


def _steps() -> tuple[Measure, ...]:
    table = over_the_table()
    # The arm works near the front camera, as in most long videos.
    video = stretch("VideoPlaceButton", 0, first=130)
    eager, stock = partial(eager_step, table), partial(stock_step, table)
    floor, physics = partial(floor_step, table), partial(physics_step, table)

    def against_stock(goal: float, name: str, ours: Callable[[Workload], float]) -> Measure:
        return Measure(goal, name, partial(ours, table), stock, "stock", "ms")

    return (
        Measure(7, "eager step, over the table", eager, stock, "stock", "ms"),
        Measure(
            5,
            "eager step, as in videos",
            partial(eager_step, video),
            partial(stock_step, video),
            "stock",
            "ms",
        ),
        against_stock(12, "... light meshes, over the table", partial(eager_step, rendering=LIGHT)),
        against_stock(70, "lazy step, 16 to a picture pair", lazy_step),
        against_stock(
            5, "exported step, PNG, over the table", partial(exported_step, coding="png")
        ),
        against_stock(5, "... lossless video", partial(exported_step, coding="lossless-video")),
        Measure(0.8, "eager step against its floor", eager, floor, "floor", "ms"),
        Measure(
            0.5, "step without pictures", partial(undrawn_step, table), physics, "physics", "ms"
        ),
    )


def _resets() -> tuple[Measure, ...]:
    episode = video_episode()
    cold, stock = partial(cold_reset, episode), partial(stock_reset, episode)
    on_demand = partial(cold, frames=False)
    return (
        Measure(4.5, "video reset, cold, all frames", cold, stock, "stock"),
        Measure(30, "video reset, cold, frames on demand", on_demand, stock, "stock"),
        Measure(60, "video reset, warm, all frames", partial(warm_reset, episode), stock, "stock"),
    )


def _processes() -> tuple[Measure, ...]:
    following, start = partial(next_episode, "ours"), partial(process_start, "ours")
    stock, stock_start = partial(next_episode, "stock"), partial(process_start, "stock")
    return (
        Measure(15, "next episode in the same process", following, stock, "stock"),
        Measure(5, "process start to first observation", start, stock_start, "stock"),
        Measure(
            0.9, "steps a second of a remote policy", over_loopback, in_process, "in process", "1/s"
        ),
        Measure(0.9, "steps a second of a hosted policy", hosted, in_process, "in process", "1/s"),
        Measure(50, "run engine, of an episode", engine_time, episode_time, "episode", "ms"),
        Measure(3, "resuming with 100,000 records", resume_time),
        Measure(0.7, "verifying an episode", verify_time),
        Measure(0.5, "memory of a process", process_memory, unit="GiB"),
    )


def _workers() -> tuple[Measure, ...]:
    """Return those of a run's workers, and of Gymnasium's."""
    slow, waving = partial(episodes_per_hour, SlowPolicy), partial(episodes_per_hour, WavingPolicy)
    return (
        Measure(
            6,
            "episodes an hour of 16 workers, 50 ms a call",
            partial(slow, 16),
            partial(slow, 1),
            "1 worker",
            "1/h",
        ),
        Measure(
            1.6,
            "episodes an hour of 2 workers",
            partial(waving, 2),
            partial(waving, 1),
            "1 worker",
            "1/h",
        ),
        Measure(
            5,
            "steps a second of AsyncVectorEnv, chunks of 16",
            vector_rate,
            partial(vector_rate, 1),
            "chunks of 1",
            "1/s",
        ),
    )


def _large_runs() -> tuple[Measure, ...]:
    return (
        Measure(5, "tables of 50,000 records, CPU", partial(command_time, "tables")),
        Measure(20, "merge of 50,000 records, CPU", partial(command_time, "records merge")),
        Measure(60, "report of 50,000 records, CPU", partial(command_time, "report")),
        Measure(1, "... memory", partial(command_memory, "report"), unit="GiB"),
    )
