"""Draw an arrangement as SVG, for the operator's page and the sheet."""

from __future__ import annotations

import math
from html import escape

from roboirg.apps.real.study.arrangement_shapes import (
    Shape,
    describe_positions,
    scene_shapes,
)
from roboirg.core.episode import Scene

NEAREST = 0.35
FARTHEST = 0.85
"""Extent of the picture along x, m."""
HALF_WIDTH = 0.3
"""Half the extent of the picture along y, m."""
SCALE = 1000.0
"""Units of the picture per meter."""
FONT_SIZE = 26.0
ROBOT_ROW = 60.0
"""Height below the table for the robot."""
MARGIN = 12
"""From the words in the corners to the edge."""
INK = "#222222"
HOLE_FILL = "#ffffffc0"
INTRODUCTION = "The table from above, the robot at the bottom."


def draw_svg(scene: Scene) -> str:
    """Return the picture of an arrangement as SVG text, the robot at the bottom.

    Its title describes it in words.
    """
    width = 2 * HALF_WIDTH * SCALE
    table = (FARTHEST - NEAREST) * SCALE
    height = table + ROBOT_ROW
    shapes = scene_shapes(scene)
    description = "; ".join(describe_positions(scene))
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}"',
        'role="img">',
        f"<title>{INTRODUCTION} {escape(description)}.</title>",
        f'<rect width="{width:g}" height="{table:g}" fill="#f4f1ea" stroke="{INK}"/>',
    ]
    lines += [_draw(shape) for shape in shapes]
    lines += [_label(shape) for shape in shapes]
    bottom = height - MARGIN
    lines.append(_text("left", MARGIN, bottom, "start"))
    lines.append(_text("▲ robot", width / 2, bottom, "middle"))
    lines.append(_text("right", width - MARGIN, bottom, "end"))
    lines.append("</svg>")
    return "\n".join(lines)


def _to_svg(x: float, y: float) -> tuple[float, float]:
    """Convert a point from the robot base frame (m; x forward, y left) to the picture's units.

    The picture's x grows to the right and its y downwards.
    """
    return (HALF_WIDTH - y) * SCALE, (FARTHEST - x) * SCALE


def _draw(shape: Shape) -> str:
    """Return a shape at its place as SVG, with its hole drawn over it."""
    x, y = _to_svg(shape.x, shape.y)
    outer = _outline(shape, shape.half, shape.fill)
    hole = _outline(shape, shape.hole, HOLE_FILL)
    # Counter-clockwise seen from above, and so is the picture.
    turn = f"translate({x:.1f} {y:.1f}) rotate({-math.degrees(shape.yaw):.1f})"
    return f'<g transform="{turn}" stroke="{INK}">{outer}{hole}</g>'


def _outline(shape: Shape, half: float, fill: str) -> str:
    """Return a square or circle around the origin as SVG; `half` is half its size, m.

    An object's hole is drawn by the same function; without a hole, `half` is 0 and nothing shows.
    """
    length = half * SCALE
    if shape.form == "square":
        size = f'width="{2 * length:.1f}" height="{2 * length:.1f}"'
        return f'<rect x="{-length:.1f}" y="{-length:.1f}" {size} fill="{fill}"/>'
    return f'<circle r="{length:.1f}" fill="{fill}"/>'


def _label(shape: Shape) -> str:
    """Return the name of an object, below the shape however it is turned."""
    x, y = _to_svg(shape.x, shape.y)
    reach = shape.half * SCALE
    if shape.form == "square":
        reach *= math.sqrt(2.0)
    return _text(shape.label, x, y + reach + FONT_SIZE, "middle")


def _text(text: str, x: float, y: float, anchor: str) -> str:
    """Return a text as SVG at a point of the picture; `anchor` is start, middle or end."""
    position = f'x="{x:.1f}" y="{y:.1f}" font-size="{FONT_SIZE:g}" text-anchor="{anchor}"'
    return f"<text {position}>{escape(text)}</text>"
