"""Draw the scenes of the real-robot tasks: boxes and tapes, one object on either side.

In the study on a Franka Research 3 (paper), two objects of a kind stand in front of the robot, one
to its left and one to its right, with either color on either side. Sizes and regions are our own:
all objects are within reach and in the images of both cameras.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from roboirg.core import object_sizes
from roboirg.core.episode import Color, ObjectKind, Scene, SceneObject
from roboirg.core.footprints import Circle, Footprint, Region
from roboirg.core.motions import Point
from roboirg.tasks.shared.fixtures import placed
from roboirg.util.random_draws import shuffled

BOX_YAW = math.radians(15.0)
"""Largest rotation of a box to either side."""

Side = Literal["left", "right"]
SIGNS: dict[Side, float] = {"left": 1.0, "right": -1.0}
"""Sign of y on each side: the robot's left is positive."""


def on_side(region: Region, side: Side) -> Region:
    """Return a region of the left side, or its mirror image on the right."""
    return region._replace(y=SIGNS[side] * region.y)


def draw_sides(rng: np.random.Generator, colors: Sequence[Color]) -> dict[Color, Side]:
    """Draw the sides of two colors, both orders equally likely."""
    left, right = shuffled(rng, colors)
    return {left: "left", right: "right"}


def left_to_right(scene: Scene, kind: ObjectKind) -> tuple[Color, ...]:
    """Return the colors of the objects of a kind, from the robot's left to its right."""
    items = sorted(scene.of_kind(kind), key=lambda item: -item.position.y)
    return tuple(item.color for item in items if item.color is not None)


def draw_box(rng: np.random.Generator, name: str, color: Color, region: Region) -> SceneObject:
    """Draw a box whose center is in the region; the region must keep it clear of other objects."""
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
    """Draw a roll of tape with any yaw, at least `gap` meters from all obstacles."""

    def draw() -> SceneObject:
        x, y = region.draw(rng, inset=object_sizes.TAPE_RADIUS)
        yaw = 2.0 * math.pi * rng.random()
        return SceneObject(name, "tape", Point(x, y, object_sizes.TAPE_HALF), yaw, color)

    def clearance(tape: SceneObject) -> Circle:
        return Circle(tape.position.x, tape.position.y, object_sizes.TAPE_RADIUS + gap)

    return placed(name, draw, clearance, obstacles)
