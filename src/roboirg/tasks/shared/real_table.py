"""Draw the scenes of the real-robot tasks: two objects of a kind, one on either side.

In the study on a Franka Research 3 (paper), two objects of a kind stand in front of the robot, one
to its left and one to its right, with either color on either side. Sizes and regions are our own:
all objects are within reach and in the images of both cameras.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from roboirg.core import object_sizes
from roboirg.core.episode import Color, ObjectKind, Scene, SceneObject
from roboirg.core.footprints import Region
from roboirg.core.motions import Point
from roboirg.util.random_draws import shuffled

BOX_YAW = math.radians(15.0)
"""Largest rotation of a box to either side."""


def draw_regions(
    rng: np.random.Generator, colors: Sequence[Color], left: Region
) -> dict[Color, Region]:
    """Draw which of two colors is on the robot's left, and return the region of each.

    `left` is the region on the left (positive y); that on the right is its mirror image.
    ``("green", "purple")`` -> ``{"green": right, "purple": left}``, for example; keys are in the
    order of `colors`.
    """
    right = left._replace(y=-left.y)
    on_left = shuffled(rng, colors)[0]
    regions = dict.fromkeys(colors, right)
    regions[on_left] = left
    return regions


def left_to_right(scene: Scene, kind: ObjectKind) -> tuple[Color, ...]:
    """Return the colors of the objects of a kind, from the robot's left to its right.

    The robot's left is at larger y. Objects without a color are passed over.
    """
    items = sorted(scene.of_kind(kind), key=lambda item: -item.position.y)
    return tuple(item.color for item in items if item.color is not None)


def draw_box(rng: np.random.Generator, name: str, color: Color, region: Region) -> SceneObject:
    """Draw a box whose center is in the region; the region must keep it clear of other objects."""
    x, y = region.draw(rng)
    # Uniform, to either side.
    yaw = (2.0 * rng.random() - 1.0) * BOX_YAW
    return SceneObject(
        name=name,
        kind="box",
        position=Point(x, y, object_sizes.BOX_HEIGHT / 2),
        yaw=yaw,
        color=color,
    )
