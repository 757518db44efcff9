"""The measures of the benchmark: timings, baselines and goals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from roboirg.apps.bench import (
    engine_costs,
    hosted_rates,
    large_run_costs,
    process_costs,
    remote_rates,
    reset_times,
    step_times,
    vector_rates,
)
from roboirg.apps.bench.workloads import Workload, as_in_demonstrations, over_the_table
from roboirg.simulation.rendering.render_settings import LIGHT

Timing = Callable[[], float]


@dataclass(frozen=True)
class Measure:
    """One measure.

    Attributes:
        name: what is measured.
        ours: returns seconds, or a figure in `unit`.
        baseline: returns the same for the baseline; None for measures without one.
        against: name of the baseline.
        goal: smallest ratio of baseline to ours; without a baseline, the largest value.
        unit: unit in tables.
        inverse: whether more is better, so that the ratio is ours to the baseline.
        package: optional package without which it cannot be measured.
    """

    name: str
    ours: Timing
    baseline: Timing | None
    against: str
    goal: float
    unit: str = "ms"
    inverse: bool = False
    package: str = ""


def measures() -> tuple[Measure, ...]:
    """Return all measures in the order of the table; a shared baseline is one object."""
    table = over_the_table()
    return (
        *_step_measures(table, as_in_demonstrations()),
        *_floor_measures(table),
        *_reset_measures(),
        *_process_measures(),
        *_worker_measures(),
        *_vector_measures(),
        *_large_run_measures(),
    )


def _step_measures(table: Workload, video: Workload) -> tuple[Measure, ...]:
    stock_table = partial(step_times.stock_step, table)
    stock_video = partial(step_times.stock_step, video)
    eager, lazy = step_times.eager_step, step_times.lazy_step
    rows: tuple[tuple[str, Timing, Timing, float], ...] = (
        ("eager step, over the table", partial(eager, table), stock_table, 7),
        ("eager step, as in videos", partial(eager, video), stock_video, 5),
        ("... light meshes, over the table", partial(eager, table, LIGHT), stock_table, 12),
        ("... light meshes, as in videos", partial(eager, video, LIGHT), stock_video, 10),
        ("lazy step, 16 to a picture pair", partial(lazy, table), stock_table, 70),
    )
    return tuple(Measure(name, ours, base, "stock", goal) for name, ours, base, goal in rows)


def _floor_measures(table: Workload) -> tuple[Measure, ...]:
    """Return measures of the cost beyond physics and drawing."""
    return (
        Measure(
            "eager step against its floor",
            partial(step_times.eager_step, table),
            partial(step_times.floor_step, table),
            "floor",
            0.8,
        ),
        Measure(
            "step without pictures",
            partial(step_times.undrawn_step, table),
            partial(step_times.physics_step, table),
            "physics",
            0.5,
        ),
    )


def _reset_measures() -> tuple[Measure, ...]:
    episode = reset_times.video_episode()
    stock = partial(reset_times.stock_reset, episode)
    cold, warm = reset_times.cold_reset, reset_times.warm_reset
    rows: tuple[tuple[str, Timing, float], ...] = (
        ("video reset, cold, all frames", partial(cold, episode, frames=True), 4.5),
        ("video reset, cold, frames on demand", partial(cold, episode, frames=False), 30),
        ("video reset, warm, all frames", partial(warm, episode, frames=True), 60),
    )
    return tuple(Measure(name, ours, stock, "stock", goal, "s") for name, ours, goal in rows)


def _process_measures() -> tuple[Measure, ...]:
    started = (
        ("next episode in the same process", process_costs.next_episode, 15),
        ("process start to first observation", process_costs.process_start, 5),
    )
    return (
        *(
            Measure(name, partial(timing, "ours"), partial(timing, "stock"), "stock", goal, "s")
            for name, timing, goal in started
        ),
        Measure(
            "steps a second of a remote policy",
            remote_rates.over_loopback,
            remote_rates.in_process,
            "in process",
            0.9,
            unit="1/s",
            inverse=True,
        ),
        Measure(
            "steps a second of a hosted policy",
            hosted_rates.hosted,
            remote_rates.in_process,
            "in process",
            0.9,
            unit="1/s",
            inverse=True,
        ),
        Measure(
            "run engine, of an episode",
            engine_costs.engine_time,
            engine_costs.episode_time,
            "episode",
            50,
        ),
        Measure("resuming with 100,000 records", engine_costs.resume_time, None, "", 3, "s"),
        Measure("memory of a process", process_costs.process_memory, None, "", 0.5, "GiB"),
    )


def _worker_measures() -> tuple[Measure, ...]:
    """Return measures of several workers with one policy process, and of what bounds them."""
    pace, costs = hosted_rates.episodes_per_hour, hosted_rates.costs
    slow, model, quick = hosted_rates.SlowPolicy, hosted_rates.TorchPolicy, hosted_rates.QuickPolicy
    numeric = process_costs.numeric_rate
    rows: tuple[tuple[str, type, int, float, str], ...] = (
        ("episodes an hour of 16 workers, 50 ms a call", slow, 16, 6, ""),
        ("... a small PyTorch model on the CPU", model, 16, 1.5, "torch"),
        ("episodes an hour of 2 workers", quick, 2, 1.6, ""),
    )
    return (
        *(
            Measure(
                name,
                partial(pace, policy, workers),
                partial(pace, policy, 1),
                "1 worker",
                goal,
                unit="1/h",
                inverse=True,
                package=package,
            )
            for name, policy, workers, goal, package in rows
        ),
        Measure(
            "plain numeric work in 2 processes",
            partial(numeric, 2),
            partial(numeric, 1),
            "1 process",
            1.6,
            unit="1/s",
            inverse=True,
        ),
        Measure(
            "processor time of an episode, 50 ms a call",
            lambda: costs(slow, 16).processor_s,
            None,
            "",
            0.4,
            "s",
        ),
        Measure("memory of a worker", lambda: costs(slow, 16).worker_gib, None, "", 0.5, "GiB"),
    )


def _vector_measures() -> tuple[Measure, ...]:
    """Return measures of the vector environment; AsyncVectorEnv draws at every step."""
    rows: tuple[tuple[Timing, str, float], ...] = (
        (vector_rates.separate_rate, f"{vector_rates.cores()} processes", 0.9),
        (vector_rates.async_rate, "AsyncVectorEnv", 1.5),
    )
    return tuple(
        Measure(
            "steps a second of a vector environment",
            vector_rates.vector_rate,
            baseline,
            against,
            goal,
            unit="1/s",
            inverse=True,
        )
        for baseline, against, goal in rows
    )


def _large_run_measures() -> tuple[Measure, ...]:
    time, memory = large_run_costs.command_time, large_run_costs.command_memory
    return (
        Measure("tables of 50,000 records, CPU", partial(time, "tables"), None, "", 5, "s"),
        Measure("merge of 50,000 records, CPU", partial(time, "merge"), None, "", 20, "s"),
        Measure("... memory", partial(memory, "merge"), None, "", 0.5, "GiB"),
        Measure("report of 50,000 records, CPU", partial(time, "report"), None, "", 60, "s"),
        Measure("... memory", partial(memory, "report"), None, "", 1, "GiB"),
    )
