"""Measure all rows of docs/performance.md: those of `roboirg bench`, exports and verification.

python scripts/bench.py --out docs/bench.json
python scripts/write_bench_table.py
"""

from __future__ import annotations

import argparse
import functools
import os
import statistics
import sys
import tempfile
import time
import zipfile
from functools import partial
from pathlib import Path

from rich.console import Console

from roboirg.apps.bench.bench_runner import results_table, run_measures, write_results
from roboirg.apps.bench.engine_costs import temporary_folder
from roboirg.apps.bench.measures import Measure, measures
from roboirg.apps.bench.step_times import stock_step
from roboirg.apps.bench.workloads import Workload, over_the_table
from roboirg.apps.demonstrations.trajectory import PictureCoding, TrajectoryFile
from roboirg.apps.demonstrations.trajectory_recorder import PictureTracks, RecordingSpec
from roboirg.apps.leaderboard.run_verification import verify_run
from roboirg.core.observations import CAMERAS
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.play.rollout import EpisodeRunner
from roboirg.evaluation.run.executor import InProcess
from roboirg.evaluation.run.runner import run_plan
from roboirg.util.console_width import widen
from roboirg.util.freed_memory import keep_freed_memory


def exported_step(workload: Workload, coding: PictureCoding) -> float:
    """Time steps whose pictures are stored in a trajectory's file; the median of all."""
    session = workload.start()
    cameras, durations = session.world.cameras, []
    with (
        tempfile.TemporaryDirectory() as folder,
        zipfile.ZipFile(Path(folder) / "trajectory.zip", "w") as archive,
    ):
        tracks = PictureTracks(TrajectoryFile(archive), RecordingSpec(coding))
        for action in workload.actions:
            start = time.perf_counter()
            session.step(action)
            pictures = cameras.pictures(CAMERAS)
            tracks.add({f"{one}_rgb": pictures[one] for one in CAMERAS}, is_video=False)
            durations.append(time.perf_counter() - start)
        tracks.finish()
    return statistics.median(durations)


def verify_time() -> float:
    """Return seconds of processor time to verify an episode, the mean over policies and tasks."""
    folder, count = _played_run()
    start = time.process_time()
    found = verify_run(folder)
    if not found.holds or found.records != count:
        raise AssertionError(f"{found.records} records of {count} were checked: {found.checks}")
    return (time.process_time() - start) / count


@functools.cache
def _played_run() -> tuple[Path, int]:
    """Return a run of the oracle, and of a policy that mostly plays to the limit, on all tasks."""
    plan = make_plan(["oracle", "random"], settings="explicit", episodes="1")
    folder = temporary_folder()
    summary = run_plan(plan, folder, EpisodeRunner(folder, plan=plan.fingerprint), InProcess())
    return folder, summary.total


def application_measures() -> tuple[Measure, ...]:
    """Return the measures of exports and of verification."""
    table = over_the_table()
    exported, stock = partial(exported_step, table), partial(stock_step, table)
    return (
        Measure("exported step, PNG, over the table", partial(exported, "png"), stock, "stock", 5),
        Measure("... lossless video", partial(exported, "lossless-video"), stock, "stock", 5),
        Measure("verifying an episode", verify_time, None, "", 0.7, "s"),
    )


def main() -> None:
    """Measure, print the table, and write the results if a file is given."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="number of repetitions")
    parser.add_argument("--out", type=Path, help="JSON file for the results")
    options = parser.parse_args()
    keep_freed_memory()
    load = os.getloadavg()[1]
    rows = (*measures(), *application_measures())
    figures = run_measures(rows, options.rounds, partial(print, file=sys.stderr))
    console, table = Console(), results_table(figures)
    widen(console, table)
    console.print(table)
    if options.out is not None:
        write_results(figures, options.out, load)


if __name__ == "__main__":
    main()
