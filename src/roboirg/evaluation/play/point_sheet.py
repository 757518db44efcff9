"""Pictures of a policy's front camera with the points of its planner's subgoals, on one sheet."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from roboirg.core.subgoal_text import Point
from roboirg.util.media import CONTROL_RATE, Pixels, contact_sheets, encode_jpeg

MOST_PICTURES = 64
"""A planner that names more is shown by its first; a sheet of eight has 40 KB."""
RING_COLOR, RING_RADIUS, RING_WIDTH = (255, 230, 0), 6, 2
"""RGB and pixels of the ring around the point of a subgoal."""


class Pointing(NamedTuple):
    """What a planner saw when it pointed, uint8 (height, width, 3), and where it pointed."""

    step: int
    picture: Pixels
    point: Point


def with_ring(picture: Pixels, point: Point) -> Pixels:
    """Return a copy of a picture with a ring around a point; inside it the picture is unchanged."""
    rows, columns = np.indices(picture.shape[:2])
    distance = np.hypot(rows - point[0], columns - point[1])
    marked = picture.copy()
    marked[np.abs(distance - RING_RADIUS) <= RING_WIDTH / 2] = RING_COLOR
    return marked


def write_point_sheet(pointings: Sequence[Pointing], path: Path) -> None:
    """Write a sheet of pictures at half their size with their times, or remove an older one.

    A sheet that cannot be written is left out, as the verdict does not depend on it.
    """
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)
        if not pointings:
            return
        frames = np.stack([with_ring(one.picture, one.point) for one in pointings])
        sheets = contact_sheets(frames, [f"{one.step / CONTROL_RATE:g} s" for one in pointings])
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(encode_jpeg(np.concatenate(list(sheets))))
