"""The measures of `roboirg bench`."""

from __future__ import annotations

from functools import partial

from roboirg.apps.bench.bench_runner import Measure
from roboirg.apps.bench.reset_times import cold_reset, stock_reset, video_episode
from roboirg.apps.bench.start_times import process_start
from roboirg.apps.bench.step_times import eager_step, lazy_step, over_the_table, stock_step
from roboirg.apps.bench.worker_rates import WavingPolicy, episodes_per_hour


def measures() -> tuple[Measure, ...]:
    """Return the measures in the order of the table; a shared baseline is one object."""
    table, episode = over_the_table(), video_episode()
    stock = partial(stock_step, table)
    pace = partial(episodes_per_hour, WavingPolicy)
    return (
        Measure("eager step, over the table", partial(eager_step, table), stock, "stock"),
        Measure("lazy step, 16 to a picture pair", partial(lazy_step, table), stock, "stock"),
        Measure(
            "video reset, cold, all frames",
            partial(cold_reset, episode),
            partial(stock_reset, episode),
            "stock",
            "s",
        ),
        Measure(
            "process start to first observation",
            partial(process_start, "ours"),
            partial(process_start, "stock"),
            "stock",
            "s",
        ),
        Measure(
            "episodes an hour of 2 workers", partial(pace, 2), partial(pace, 1), "1 worker", "1/h"
        ),
    )
