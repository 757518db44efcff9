"""An arrangement as an SVG picture, for the operator's page."""

from __future__ import annotations

import math
from html import escape

from roboirg.core.episode import Scene
from roboirg.real.pages.arrangement_drawing import (
    FARTHEST,
    HALF_WIDTH,
    INK,
    NEAREST,
    Shape,
    corners,
    shapes_of,
    where,
)

SCALE = 1000.0
"""Units of the picture per meter."""
LETTER = 26.0
ROBOT = 60.0
INTRODUCTION = "The table from above, the robot at the bottom."


def draw_svg(scene: Scene) -> str:
    """The picture; its title says the same in words."""
    width, height = 2 * HALF_WIDTH * SCALE, (FARTHEST - NEAREST) * SCALE + ROBOT
    shapes = shapes_of(scene)
    words = "; ".join(where(shape) for shape in shapes)
    middle, bottom = width / 2, height - 12
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}"',
        'role="img" aria-labelledby="drawing">',
        f'<title id="drawing">{INTRODUCTION} {escape(words)}.</title>',
        f'<rect width="{width:g}" height="{height - ROBOT:g}" fill="#f4f1ea" stroke="{INK}"/>',
        *(_draw(shape) for shape in shapes),
        *(_label(shape) for shape in shapes),
        _word("left", 12, bottom, "start"),
        _word("▲ robot", middle, bottom, "middle"),
        _word("right", width - 12, bottom, "end"),
        "</svg>",
    ]
    return "\n".join(parts)


def _at(x: float, y: float) -> tuple[float, float]:
    return (HALF_WIDTH - y) * SCALE, (FARTHEST - x) * SCALE


def _draw(shape: Shape) -> str:
    if shape.form == "square":
        outer, inner = (
            " ".join("{:.1f},{:.1f}".format(*_at(*corner)) for corner in corners(shape, half))
            for half in (shape.half, shape.hole)
        )
        return (
            f'<polygon points="{outer}" fill="{shape.fill}" stroke="{INK}"/>'
            f'<polygon points="{inner}" fill="#ffffff" fill-opacity="0.75" stroke="{INK}"/>'
        )
    x, y = _at(shape.x, shape.y)
    drawn = (
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{shape.half * SCALE:.1f}" fill="{shape.fill}" '
        f'stroke="{INK}"/>'
    )
    if shape.hole:
        hole = shape.hole * SCALE
        drawn += f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{hole:.1f}" fill="#fff" stroke="{INK}"/>'
    return drawn


def _label(shape: Shape) -> str:
    x, y = _at(shape.x, shape.y)
    reach = shape.half * (math.sqrt(2.0) if shape.form == "square" else 1.0) * SCALE
    return _word(shape.label, x, y + reach + LETTER, "middle")


def _word(text: str, x: float, y: float, anchor: str) -> str:
    place = f'x="{x:.1f}" y="{y:.1f}" font-size="{LETTER:g}" text-anchor="{anchor}"'
    return f"<text {place}>{escape(text)}</text>"
