"""Seconds per control step of an export: physics, both pictures, their coding and statistics."""

from __future__ import annotations

import statistics
import tempfile
import time
import zipfile
from pathlib import Path

from roboirg.core.observations import CAMERAS
from roboirg.demonstrations.trajectory import PictureCoding, TrajectoryFile
from roboirg.demonstrations.trajectory_recorder import PictureTracks, RecordingSpec
from roboirg.perf.workloads import Workload


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
