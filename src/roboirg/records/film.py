"""The videos that a run records: their format, and where they are."""

from __future__ import annotations

from pathlib import PurePosixPath
from typing import Literal

VideoMode = Literal["off", "failures", "all"]
"""Which episodes get a video."""
VIDEO_FOLDER = "videos"
FRAME_STEPS = 8
FRAME_RATE = 10
"""Control steps between two frames (20 are one second), and frames per second: fourfold speed."""
LAST_FRAME_REPEATS = 8
"""The last frame stays for most of a second, so that a viewer sees how the episode ended."""


def poster_name(video: str) -> str:
    """Return the path of the picture of a video's last frame."""
    return str(PurePosixPath(video).with_suffix(".jpg"))
