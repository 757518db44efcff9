"""Grounded subgoals: a stage in words with the pixel of its object in the front picture."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from roboirg.core.episode import Stage
from roboirg.core.subgoal_text import Point
from roboirg.judging import plain_subgoal
from roboirg.simulation.bodies import Body
from roboirg.simulation.cameras import Cameras

CAMERA = "front"
REACH_PIXELS = 6
"""How far from an object a point may be that means it; a cube is 10 to 20 pixels wide."""


class PixelGrounding:
    """Follows the stages of one episode and puts pixels into their texts.

    It draws only until a stage's object is visible.

    Attributes:
        text: the current subgoal, with ``at <y, x>`` (row and column in the front picture) from
            the first frame in which the stage is due and its object visible.
    """

    def __init__(self, bodies: Mapping[str, Body], cameras: Cameras) -> None:
        self._bodies = bodies
        self._cameras = cameras
        self._stage: Stage | None = None
        self._has_pixel = False
        self.text = ""

    def update(self, stage: Stage | None) -> None:
        """Update the text; call it after every control step.

        Args:
            stage: the stage whose subgoal is published; None after the last one keeps the text.
        """
        if stage is None:
            return
        if stage is not self._stage:
            self._stage = stage
            self._has_pixel = False
            self.text = plain_subgoal(stage)
        if self._has_pixel or stage.points_at is None:
            return
        pixel = self._pixel(stage.points_at)
        if pixel is not None:
            row, column = pixel
            self._has_pixel = True
            self.text = stage.subgoal.replace("{at}", f"at <{row}, {column}>")

    def _pixel(self, name: str) -> Point | None:
        """Return the mean row and column of an object's visible pixels; None if it has none."""
        is_object = self._cameras.segmentation(CAMERA) == self._bodies[name].segment
        rows, columns = np.nonzero(is_object)
        if not len(rows):
            return None
        return int(rows.mean()), int(columns.mean())


def objects_at(bodies: Mapping[str, Body], cameras: Cameras, point: Point) -> frozenset[str]:
    """Return the names of the objects seen within `REACH_PIXELS` of a point of the picture."""
    row, column = point
    around = cameras.segmentation(CAMERA)[_reach_of(row), _reach_of(column)]
    segments = np.unique(around).tolist()
    return frozenset(name for name, body in bodies.items() if body.segment in segments)


def _reach_of(pixel: int) -> slice:
    """Return the rows or columns within `REACH_PIXELS` of one, as a slice from 0 on."""
    return slice(max(pixel - REACH_PIXELS, 0), pixel + REACH_PIXELS + 1)
