"""The objects of an arrangement as shapes seen from above, for drawings and descriptions.

Frame: the robot's base, x forward, y to its left, meters. Drawings have the robot at the bottom, so
left and right are as seen from the robot.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

from roboirg.core import object_sizes
from roboirg.core.episode import ROBOT_BASE, Scene, SceneObject

FILLS = {"green": "#3a9d5d", "purple": "#8a5fb5", "yellow": "#f2c230", "gray": "#8c8c8c"}
TARGET_FILL = "#d9482b"


class Shape(NamedTuple):
    """The shape of one object.

    Attributes:
        form: square, ring or disc.
        x: forward of the robot's base, m.
        y: to its left, m.
        yaw: counter-clockwise seen from above, rad.
        half: half the side, or the outer radius, m.
        hole: half the side, or radius, of the hole; 0 for none.
        fill: color.
        label: name of the object, so that color is not the only clue.
    """

    form: Literal["square", "ring", "disc"]
    x: float
    y: float
    yaw: float
    half: float
    hole: float
    fill: str
    label: str


def scene_shapes(scene: Scene) -> tuple[Shape, ...]:
    """Return a shape for each object on the table."""
    return tuple(_shape(item) for item in scene.objects)


def describe_positions(scene: Scene) -> tuple[str, ...]:
    """Return the name and position of each object in words, to measure with a tape."""
    return tuple(
        f"{one.label}: {100 * one.x:.0f} cm forward, {100 * abs(one.y):.0f} cm "
        f"{'left' if one.y >= 0 else 'right'}"
        for one in scene_shapes(scene)
    )


def _shape(item: SceneObject) -> Shape:
    x, y = item.position.x - ROBOT_BASE[0], item.position.y - ROBOT_BASE[1]
    if item.kind == "box":
        half, hole = object_sizes.BOX_HALF, object_sizes.BOX_HALF - object_sizes.BOX_WALL
        fill = FILLS[str(item.color)]
        return Shape("square", x, y, item.yaw, half, hole, fill, f"{item.color} box")
    if item.kind == "tape":
        fill, label = FILLS[str(item.color)], f"{item.color} tape"
        radius, hole = object_sizes.TAPE_RADIUS, object_sizes.TAPE_HOLE_RADIUS
        return Shape("ring", x, y, item.yaw, radius, hole, fill, label)
    return Shape("disc", x, y, item.yaw, float(item.radius or 0.0), 0.0, TARGET_FILL, item.name)
