"""Draw an arrangement as SVG, for the operator's page."""

from __future__ import annotations

import math
from html import escape

from roboirg.apps.real.study.arrangement_shapes import (
    FARTHEST,
    HALF_WIDTH,
    INK,
    NEAREST,
    Shape,
    describe_position,
    scene_shapes,
    square_corners,
)
from roboirg.core.episode import Scene

SCALE = 1000.0
"""Units of the picture per meter."""
FONT_SIZE = 26.0
ROBOT_ROW = 60.0
"""Height below the table for the robot."""
INTRODUCTION = "The table from above, the robot at the bottom."


def draw_svg(scene: Scene) -> str:
    """Return the picture; its title describes it in words."""
    width, height = 2 * HALF_WIDTH * SCALE, (FARTHEST - NEAREST) * SCALE + ROBOT_ROW
    shapes = scene_shapes(scene)
    description = "; ".join(describe_position(shape) for shape in shapes)
    middle, bottom = width / 2, height - 12
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}"',
        'role="img" aria-labelledby="drawing">',
        f'<title id="drawing">{INTRODUCTION} {escape(description)}.</title>',
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
    if shape.form == "square":
        outer, inner = (
            " ".join("{:.1f},{:.1f}".format(*_to_svg(*one)) for one in square_corners(shape, half))
            for half in (shape.half, shape.hole)
        )
        return (
            f'<polygon points="{outer}" fill="{shape.fill}" stroke="{INK}"/>'
            f'<polygon points="{inner}" fill="#ffffff" fill-opacity="0.75" stroke="{INK}"/>'
        )
    x, y = _to_svg(shape.x, shape.y)
    svg = (
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{shape.half * SCALE:.1f}" fill="{shape.fill}" '
        f'stroke="{INK}"/>'
    )
    if shape.hole:
        hole = shape.hole * SCALE
        svg += f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{hole:.1f}" fill="#fff" stroke="{INK}"/>'
    return svg


def _label(shape: Shape) -> str:
    x, y = _to_svg(shape.x, shape.y)
    reach = shape.half * (math.sqrt(2.0) if shape.form == "square" else 1.0) * SCALE
    return _text(shape.label, x, y + reach + FONT_SIZE, "middle")


def _text(text: str, x: float, y: float, anchor: str) -> str:
    position = f'x="{x:.1f}" y="{y:.1f}" font-size="{FONT_SIZE:g}" text-anchor="{anchor}"'
    return f"<text {position}>{escape(text)}</text>"
