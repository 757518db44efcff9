"""Estimate how big an export gets, before it starts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from roboirg.apps.demonstrations.export_plan import ExportPlan, recording_jobs
from roboirg.core.observations import CAMERAS
from roboirg.util.media import PICTURE_SIZE

_LENGTHS: Mapping[str, tuple[int, int]] = {
    "PickXtimes": (508, 0),
    "StopCube": (279, 0),
    "SwingXtimes": (395, 0),
    "BinFill": (571, 0),
    "VideoUnmaskSwap": (183, 154),
    "VideoUnmask": (140, 66),
    "ButtonUnmaskSwap": (391, 0),
    "ButtonUnmask": (255, 0),
    "VideoRepick": (387, 310),
    "VideoPlaceButton": (172, 799),
    "VideoPlaceOrder": (173, 1003),
}
"""Control steps of the oracle and of the video: means of the training episodes, of the last three
tasks of twelve of them. Single episodes differ: StopCube's have 89 to 540 steps."""
_OTHER_TASK = (314, 212)
_FRAME_BYTES = {"png": 205_000, "lossless-video": 67_000, "lossy-video": 8_800, "none": 0}
"""Bytes of both pictures of a frame, 256 pixels wide."""
_HDF5_FRAME_BYTES = 257_000
"""Bytes of a time step with pictures and depth, both compressed."""
_WAYPOINT_STEPS = 20
"""Control steps of a waypoint: the mean of all tasks."""
_ROW_BYTES = 150
"""Bytes of a frame without pictures."""


class SizeEstimate(NamedTuple):
    """How big an export gets.

    Attributes:
        trajectories: to record.
        episodes: of the dataset: instructions of all trajectories.
        frames: of the dataset.
        size: of the dataset, bytes; its working files need as much again while it is written,
            at most.
    """

    trajectories: int
    episodes: int
    frames: int
    size: int


def estimate_size(plan: ExportPlan) -> SizeEstimate:
    """Estimate the size of an export from mean lengths and sizes of frames."""
    jobs = recording_jobs(plan)
    frames = pictures = 0
    for job, said in jobs:
        steps, video = _LENGTHS.get(job.task, _OTHER_TASK)
        if plan.actions == "waypoint":
            steps //= _WAYPOINT_STEPS
        length = steps + (video if plan.video != "none" else 0)
        frames += length * len(said)
        # Version 2.1 has a file for each episode; the others store pictures once.
        pictures += length * (len(said) if plan.format == "lerobot-v2.1" else 1)
    own = _HDF5_FRAME_BYTES if plan.format == "robomme-hdf5" else _FRAME_BYTES[plan.pictures]
    share = len(plan.cameras) / len(CAMERAS) * (plan.size / PICTURE_SIZE) ** 2
    episodes = sum(len(said) for _, said in jobs)
    size = int(pictures * own * share) + frames * _ROW_BYTES
    return SizeEstimate(len(jobs), episodes, frames, size)


def size_text(size: int) -> str:
    """Return a number of bytes in words, such as ``"1.3 GB"``."""
    amount = float(size)
    for unit in ("B", "kB", "MB"):
        if amount < 1000:  # noqa: PLR2004
            return f"{amount:.3g} {unit}"
        amount /= 1000
    return f"{amount:.3g} GB"
