"""What the two real-robot tasks share: boxes and tapes, and two of a kind on either side.

In the study on a Franka Research 3 (paper) two things of a kind stand before the robot, one to its
left and one to its right, and either color may be on either side. Sizes and regions are our own:
everything is within reach and in the pictures of both cameras.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from roboirg.core import object_sizes
from roboirg.core.episode import Color, ObjectKind, Scene, SceneObject
from roboirg.core.motions import Point
from roboirg.tasks.shared.fixtures import placed
from roboirg.tasks.shared.placement import Circle, Footprint, Rectangle, Region

BOX_YAW = math.radians(15.0)
"""A box is turned by at most so much to either side."""

Side = Literal["left", "right"]
SIGNS: dict[Side, float] = {"left": 1.0, "right": -1.0}
"""Of y: the robot's left is positive."""


def on_side(region: Region, side: Side) -> Region:
    """A region that is given for the left, or its mirror image."""
    return region._replace(y=SIGNS[side] * region.y)


def draw_sides(rng: np.random.Generator, colors: Sequence[Color]) -> tuple[Color, Color]:
    """Which of two colors is on the left and which on the right, both orders as likely."""
    first, second = (colors[index] for index in rng.permutation(len(colors)))
    return first, second


def left_to_right(scene: Scene, kind: ObjectKind) -> tuple[Color, ...]:
    """The colors of the things of a kind, from the robot's left to its right."""
    things = sorted(scene.of_kind(kind), key=lambda item: -item.position.y)
    return tuple(item.color for item in things if item.color is not None)


def box_footprint(box: SceneObject) -> Rectangle:
    """The square that a box covers."""
    half = object_sizes.BOX_HALF
    return Rectangle(box.position.x, box.position.y, half, half, box.yaw)


def tape_footprint(tape: SceneObject) -> Circle:
    """The disc that a roll of tape covers."""
    return Circle(tape.position.x, tape.position.y, object_sizes.TAPE_RADIUS)


def draw_box(rng: np.random.Generator, name: str, color: Color, region: Region) -> SceneObject:
    """A box whose center is anywhere in the region; its region has to keep it clear of others."""
    x, y = region.draw(rng)
    yaw = (2.0 * rng.random() - 1.0) * BOX_YAW
    return SceneObject(name, "box", Point(x, y, object_sizes.BOX_HEIGHT / 2), yaw, color)


def draw_tape(
    rng: np.random.Generator,
    name: str,
    color: Color,
    region: Region,
    gap: float,
    obstacles: Sequence[Footprint],
) -> SceneObject:
    """A roll of tape with any yaw, at least `gap` meters from all obstacles.

    Raises:
        SceneRejectedError: no free place was found.
    """

    def draw() -> SceneObject:
        x, y = region.draw(rng, inset=object_sizes.TAPE_RADIUS)
        yaw = 2.0 * math.pi * rng.random()
        return SceneObject(name, "tape", Point(x, y, object_sizes.TAPE_HALF), yaw, color)

    def clearance(tape: SceneObject) -> Circle:
        return Circle(tape.position.x, tape.position.y, object_sizes.TAPE_RADIUS + gap)

    return placed(name, draw, clearance, obstacles)
