"""The videos that a run records: their format, and where they are."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Literal, get_args

VideoMode = Literal["off", "failures", "all"]
VIDEO_MODES: tuple[VideoMode, ...] = get_args(VideoMode)
"""Which episodes get a video."""
VIDEO_FOLDER = "videos"
_POINTS = "-points.jpg"
LAST_FRAME_REPEATS = 8
"""The last frame stays for most of a second, so that a viewer sees how the episode ended."""


@dataclass(frozen=True, slots=True)
class VideoOptions:
    """Format of a video.

    Attributes:
        every: control steps between two frames (20 control steps are one second).
        rate: frames per second of the video; 10 with every 8th step is fourfold speed.
        cameras: shown side by side, 256 pixels each, with a black line of `GAP` between them.
        quality: x264's constant rate factor; higher is smaller.
    """

    every: int = 8
    rate: int = 10
    cameras: tuple[str, ...] = ("front", "wrist")
    quality: int = 28


def poster_name(video: str) -> str:
    """Return the path of the picture of a video's last frame."""
    return str(PurePosixPath(video).with_suffix(".jpg"))


def points_name(slug: str) -> str:
    """Return the path, in a run's folder, of the sheet with a planner's points in an episode."""
    return f"{VIDEO_FOLDER}/{slug}{_POINTS}"


def pointed_slugs(folder: Path) -> frozenset[str]:
    """Return the slugs of a run's episodes that have such a sheet."""
    found = (folder / VIDEO_FOLDER).glob(f"[!.]*{_POINTS}")
    return frozenset(path.name.removesuffix(_POINTS) for path in found)
