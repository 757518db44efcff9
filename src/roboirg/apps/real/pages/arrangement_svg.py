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

NEAREST, FARTHEST = 0.35, 0.85
"""Extent of the picture along x, m."""
HALF_WIDTH = 0.3
"""Half the extent of the picture along y, m."""
SCALE = 1000.0
"""Units of the picture per meter."""
FONT_SIZE = 26.0
ROBOT_ROW = 60.0
"""Height below the table for the robot."""
INK = "#222222"
_ELEMENTS = {"square": "rect", "ring": "circle", "disc": "circle"}
INTRODUCTION = "The table from above, the robot at the bottom."


def draw_svg(scene: Scene) -> str:
    """Return the picture; its title describes it in words."""
    width, height = 2 * HALF_WIDTH * SCALE, (FARTHEST - NEAREST) * SCALE + ROBOT_ROW
    shapes, description = scene_shapes(scene), "; ".join(describe_positions(scene))
    middle, bottom = width / 2, height - 12
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}"',
        'role="img">',
        f"<title>{INTRODUCTION} {escape(description)}.</title>",
        f'<rect width="{width:g}" height="{height - ROBOT_ROW:g}" fill="#f4f1ea" stroke="{INK}"/>',
        *(_draw(shape) for shape in shapes),
        *(_label(shape) for shape in shapes),
        _text("left", 12, bottom, "start"),
        _text("▲ robot", middle, bottom, "middle"),
        _text("right", width - 12, bottom, "end"),
        "</svg>",
    ]
    return "\n".join(parts)


def _to_svg(x: float, y: float) -> tuple[float, float]:
    """Convert from the robot base frame, m, to the picture."""
    return (HALF_WIDTH - y) * SCALE, (FARTHEST - x) * SCALE


def _draw(shape: Shape) -> str:
    x, y = _to_svg(shape.x, shape.y)
    drawn = ""
    for half, fill in ((shape.half, shape.fill), (shape.hole, "#ffffffc0")):
        side = half * SCALE
        size = f'r="{side:.1f}"'
        if shape.form == "square":
            size = f'x="{-side:.1f}" y="{-side:.1f}" width="{2 * side:.1f}" height="{2 * side:.1f}"'
        drawn += f'<{_ELEMENTS[shape.form]} {size} fill="{fill}"/>'
    # Counter-clockwise seen from above, and so is the picture.
    turn = f"translate({x:.1f} {y:.1f}) rotate({-math.degrees(shape.yaw):.1f})"
    return f'<g transform="{turn}" stroke="{INK}">{drawn}</g>'


def _label(shape: Shape) -> str:
    x, y = _to_svg(shape.x, shape.y)
    reach = shape.half * (math.sqrt(2.0) if shape.form == "square" else 1.0) * SCALE
    return _text(shape.label, x, y + reach + FONT_SIZE, "middle")


def _text(text: str, x: float, y: float, anchor: str) -> str:
    position = f'x="{x:.1f}" y="{y:.1f}" font-size="{FONT_SIZE:g}" text-anchor="{anchor}"'
    return f"<text {position}>{escape(text)}</text>"
