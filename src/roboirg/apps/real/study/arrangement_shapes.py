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


Form = Literal["square", "ring", "disc"]


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

    form: Form
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
    return tuple(_position_in_words(shape) for shape in scene_shapes(scene))


def _position_in_words(shape: Shape) -> str:
    """Return for example ``green box: 45 cm forward, 10 cm left``."""
    side = "left" if shape.y >= 0 else "right"
    forward = f"{100 * shape.x:.0f} cm forward"
    return f"{shape.label}: {forward}, {100 * abs(shape.y):.0f} cm {side}"


def _shape(item: SceneObject) -> Shape:
    """Return the shape of an object; what is neither box nor tape is a target on the table."""
    form, half, hole = _outline(item)
    is_target = form == "disc"
    return Shape(
        form=form,
        x=item.position.x - ROBOT_BASE[0],
        y=item.position.y - ROBOT_BASE[1],
        yaw=item.yaw,
        half=half,
        hole=hole,
        fill=TARGET_FILL if is_target else FILLS[str(item.color)],
        label=item.name if is_target else f"{item.color} {item.kind}",
    )


def _outline(item: SceneObject) -> tuple[Form, float, float]:
    """Return form, half size (m) and half size of the hole (m; 0 for none) of an object's shape."""
    if item.kind == "box":
        return "square", object_sizes.BOX_HALF, object_sizes.BOX_HALF - object_sizes.BOX_WALL
    if item.kind == "tape":
        return "ring", object_sizes.TAPE_RADIUS, object_sizes.TAPE_HOLE_RADIUS
    return "disc", float(item.radius or 0.0), 0.0
