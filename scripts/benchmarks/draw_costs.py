"""Seconds per control step in other ways than a run's: undrawn, floor, exported."""

from __future__ import annotations

import statistics
import tempfile
import time
import zipfile
from pathlib import Path

from benchmarks.step_times import CHUNK, Action, Workload, median_time
from roboirg.apps.demonstrations.picture_coding import PictureCoding
from roboirg.apps.demonstrations.trajectory_recorder import PictureTracks, RecordingSpec
from roboirg.core.observations import CAMERAS


def floor_step(workload: Workload) -> float:
    """Time physics and pictures of what is visible, without rules, words or observations."""
    world = workload.start().world
    world.cameras.pictures(CAMERAS)

    def step(action: Action) -> None:
        world.advance(action)
        world.cameras.pictures(CAMERAS)

    return median_time(workload, step)


def undrawn_step(workload: Workload) -> float:
    """Time physics and rules."""
    return median_time(workload, workload.start(visible=False).step, CHUNK)


def physics_step(workload: Workload) -> float:
    """Time physics alone."""
    return median_time(workload, workload.start(visible=False).world.advance, CHUNK)


def exported_step(workload: Workload, coding: PictureCoding) -> float:
    """Time steps whose pictures are stored in a trajectory's file; the median of all."""
    session = workload.start()
    cameras = session.world.cameras
    durations = []
    with (
        tempfile.TemporaryDirectory() as folder,
        zipfile.ZipFile(Path(folder) / "trajectory.zip", "w") as archive,
    ):
        tracks = PictureTracks(archive, RecordingSpec(coding))
        for action in workload.actions:
            start = time.perf_counter()
            session.step(action)
            pictures = cameras.pictures(CAMERAS)
            tracks.add({f"{camera}_rgb": pictures[camera] for camera in CAMERAS})
            durations.append(time.perf_counter() - start)
        tracks.finish()
    return statistics.median(durations)
