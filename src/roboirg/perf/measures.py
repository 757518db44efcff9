"""What is measured, against what, and how much is wanted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from roboirg.perf import engine_costs, process_costs, remote_rates, reset_times, step_times
from roboirg.perf.workloads import Workload, as_in_demonstrations, over_the_table
from roboirg.simulation.rendering.render_settings import LIGHT

Timing = Callable[[], float]


@dataclass(frozen=True)
class Measure:
    """One figure.

    Attributes:
        name: what is measured.
        ours: gives seconds, or what `unit` says.
        baseline: gives the same for what it is compared with; None for figures that stand alone.
        against: what the baseline is.
        goal: the wanted ratio of baseline to ours; of figures that stand alone the most wanted.
        unit: of the figures.
        inverse: more is better, so the ratio is ours to the baseline.
    """

    name: str
    ours: Timing
    baseline: Timing | None
    against: str
    goal: float
    unit: str = "ms"
    inverse: bool = False


def measures() -> tuple[Measure, ...]:
    """Everything, in the order of the table; a baseline that several have is one function."""
    table, shown = over_the_table(), as_in_demonstrations()
    video = reset_times.video_episode()

    def stock_table() -> float:
        return step_times.stock_step(table)

    def stock_video() -> float:
        return step_times.stock_step(shown)

    def stock_reset() -> float:
        return reset_times.stock_reset(video)

    stepped = (
        ("eager step, over the table", lambda: step_times.eager_step(table), stock_table, 7),
        ("eager step, as in videos", lambda: step_times.eager_step(shown), stock_video, 5),
        (
            "... light meshes, over the table",
            lambda: step_times.eager_step(table, LIGHT),
            stock_table,
            12,
        ),
        (
            "... light meshes, as in videos",
            lambda: step_times.eager_step(shown, LIGHT),
            stock_video,
            10,
        ),
        ("lazy step, 16 to a picture pair", lambda: step_times.lazy_step(table), stock_table, 70),
    )
    reset = (
        ("video reset, cold, all frames", lambda: reset_times.cold_reset(video, frames=True), 4.5),
        (
            "video reset, cold, frames on demand",
            lambda: reset_times.cold_reset(video, frames=False),
            30,
        ),
        ("video reset, warm, all frames", lambda: reset_times.warm_reset(video, frames=True), 60),
    )
    started = (
        ("next episode in the same process", process_costs.next_episode, 15),
        ("process start to first observation", process_costs.process_start, 5),
    )
    return (
        *(Measure(name, ours, base, "stock", goal) for name, ours, base, goal in stepped),
        *_floors(table),
        *(Measure(name, ours, stock_reset, "stock", goal, "s") for name, ours, goal in reset),
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
            "run engine, of an episode",
            engine_costs.engine_time,
            engine_costs.episode_time,
            "episode",
            50,
        ),
        Measure("resuming with 100,000 records", engine_costs.resume_time, None, "", 3, "s"),
        Measure("memory of a process", process_costs.process_memory, None, "", 0.5, "GiB"),
        Measure(
            "steps a second of 2 processes",
            partial(process_costs.throughput, 2),
            partial(process_costs.throughput, 1),
            "1 process",
            1.6,
            unit="1/s",
            inverse=True,
        ),
    )


def _floors(table: Workload) -> tuple[Measure, ...]:
    """What our own logic costs beyond physics and drawing."""
    return (
        Measure(
            "eager step against its floor",
            lambda: step_times.eager_step(table),
            lambda: step_times.floor_step(table),
            "floor",
            0.8,
        ),
        Measure(
            "step without pictures",
            lambda: step_times.undrawn_step(table),
            lambda: step_times.physics_step(table),
            "physics",
            0.5,
        ),
    )
