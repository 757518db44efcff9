"""The format of the videos that a run records."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

VideoMode = Literal["off", "failures", "all"]
VIDEO_MODES: tuple[VideoMode, ...] = get_args(VideoMode)
"""Which episodes get a video."""
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
