"""All our measures in the order of docs/performance.md, each with its goal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from benchmarks import (
    draw_costs,
    engine_costs,
    large_run_costs,
    many_workers,
    process_costs,
    remote_rates,
    vector_rates,
    verification_costs,
)
from roboirg.apps.bench import measures
from roboirg.apps.bench.bench_runner import Measure
from roboirg.apps.bench.reset_times import cold_reset, video_episode
from roboirg.apps.bench.step_times import eager_step, over_the_table, stock_step, stretch
from roboirg.apps.bench.worker_rates import episodes_per_hour
from roboirg.simulation.rendering.render_settings import LIGHT


@dataclass(frozen=True)
class Goal:
    """A measure and what it has to reach.

    Attributes:
        least: smallest ratio; without a baseline, the largest value.
        measure: the measure.
    """

    least: float
    measure: Measure


def all_goals() -> tuple[Goal, ...]:
    """Return all measures with their goals; a shared baseline is one object."""
    step, lazy, reset, start, workers = measures.measures()
    return (
        Goal(7, step),
        Goal(70, lazy),
        *_step_goals(step),
        Goal(4.5, reset),
        *_reset_goals(reset),
        Goal(5, start),
        *_process_goals(),
        Goal(1.6, workers),
        *_worker_goals(),
        *_large_run_goals(),
    )


def _step_goals(step: Measure) -> tuple[Goal, ...]:
    table = over_the_table()
    # The arm works near the front camera, as in most long videos.
    video = stretch("VideoPlaceButton", 0, first=130)
    near, stock = partial(stock_step, video), step.baseline
    exported = partial(draw_costs.exported_step, table)
    light = partial(eager_step, table, LIGHT)
    floor, physics = draw_costs.floor_step, draw_costs.physics_step
    undrawn = partial(draw_costs.undrawn_step, table)
    return (
        Goal(5, Measure("eager step, as in videos", partial(eager_step, video), near, "stock")),
        Goal(12, Measure("... light meshes, over the table", light, stock, "stock")),
        Goal(
            5,
            Measure("exported step, PNG, over the table", partial(exported, "png"), stock, "stock"),
        ),
        Goal(5, Measure("... lossless video", partial(exported, "lossless-video"), stock, "stock")),
        Goal(
            0.8,
            Measure("eager step against its floor", step.ours, partial(floor, table), "floor"),
        ),
        Goal(0.5, Measure("step without pictures", undrawn, partial(physics, table), "physics")),
    )


def _reset_goals(reset: Measure) -> tuple[Goal, ...]:
    episode, stock = video_episode(), reset.baseline
    on_demand = partial(cold_reset, episode, frames=False)
    warm = partial(draw_costs.warm_reset, episode)
    return (
        Goal(30, Measure("video reset, cold, frames on demand", on_demand, stock, "stock", "s")),
        Goal(60, Measure("video reset, warm, all frames", warm, stock, "stock", "s")),
    )


def _process_goals() -> tuple[Goal, ...]:
    ours, stock = (partial(process_costs.next_episode, path) for path in ("ours", "stock"))
    engine, episode = engine_costs.engine_time, engine_costs.episode_time
    return (
        Goal(15, Measure("next episode in the same process", ours, stock, "stock", "s")),
        _against_in_process("steps a second of a remote policy", remote_rates.over_loopback),
        _against_in_process("steps a second of a hosted policy", remote_rates.hosted),
        Goal(50, Measure("run engine, of an episode", engine, episode, "episode")),
        _limit(3, "resuming with 100,000 records", engine_costs.resume_time),
        _limit(0.7, "verifying an episode", verification_costs.verify_time),
        _limit(0.5, "memory of a process", process_costs.process_memory, "GiB"),
    )


def _against_in_process(name: str, ours: Callable[[], float]) -> Goal:
    return Goal(0.9, Measure(name, ours, remote_rates.in_process, "in process", "1/s"))


def _limit(most: float, name: str, ours: Callable[[], float], unit: str = "s") -> Goal:
    return Goal(most, Measure(name, ours, None, "", unit))


def _worker_goals() -> tuple[Goal, ...]:
    """Return those of workers, of what bounds them, and of the vector environment."""
    slow = partial(episodes_per_hour, many_workers.SlowPolicy)
    numeric = many_workers.numeric_rate
    return (
        Goal(
            6,
            Measure(
                "episodes an hour of 16 workers, 50 ms a call",
                partial(slow, 16),
                partial(slow, 1),
                "1 worker",
                "1/h",
            ),
        ),
        Goal(
            1.6,
            Measure(
                "plain numeric work in 2 processes",
                partial(numeric, 2),
                partial(numeric, 1),
                "1 process",
                "1/s",
            ),
        ),
        Goal(
            5,
            Measure(
                "steps a second of AsyncVectorEnv, chunks of 16",
                vector_rates.vector_rate,
                partial(vector_rates.vector_rate, 1),
                "chunks of 1",
                "1/s",
            ),
        ),
    )


def _large_run_goals() -> tuple[Goal, ...]:
    time, memory = large_run_costs.command_time, large_run_costs.command_memory
    return (
        _limit(5, "tables of 50,000 records, CPU", partial(time, "tables")),
        _limit(20, "merge of 50,000 records, CPU", partial(time, "records merge")),
        _limit(60, "report of 50,000 records, CPU", partial(time, "report")),
        _limit(1, "... memory", partial(memory, "report"), "GiB"),
    )
