"""The mesh of a tube, which draws a roll of tape; SAPIEN's own shapes have no holes."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
import sapien
import sapien.render
from numpy.typing import NDArray

Rgba = tuple[float, float, float, float]

SEGMENTS = 48
"""Corners of the circles."""


class _Band(NamedTuple):
    """A band between two circles around the vertical axis, one of the four surfaces of a tube.

    Attributes:
        circles: radius and height of both, m.
        outward: the part of the band's unit normal that points away from the axis.
        upward: the vertical part.
    """

    circles: tuple[tuple[float, float], tuple[float, float]]
    outward: float
    upward: float


@functools.cache
def tube_mesh(
    outer: float, inner: float, half: float, rgba: Rgba
) -> sapien.render.RenderShapeTriangleMesh:
    """Return an upright tube centered at the origin, to be cloned and attached to a body.

    Args:
        outer: outer radius, m.
        inner: radius of the hole, m.
        half: half the height, m.
        rgba: color, 0 to 1 each.
    """
    # Outer wall, top, inner wall, bottom. They share no vertices, so that edges are sharp.
    bands = (
        _Band(((outer, -half), (outer, half)), outward=1.0, upward=0.0),
        _Band(((outer, half), (inner, half)), outward=0.0, upward=1.0),
        _Band(((inner, half), (inner, -half)), outward=-1.0, upward=0.0),
        _Band(((inner, -half), (outer, -half)), outward=0.0, upward=-1.0),
    )
    vertices = []
    normals = []
    triangles = []
    for number, band in enumerate(bands):
        for radius, height in band.circles:
            vertices.append(_ring(radius, height))
            normals.append(_ring(band.outward, band.upward))
        triangles.append(_band_triangles(2 * number * SEGMENTS))
    positions = np.concatenate(vertices).astype(np.float32)
    return sapien.render.RenderShapeTriangleMesh(
        vertices=positions,
        triangles=np.concatenate(triangles).astype(np.uint32),
        normals=np.concatenate(normals).astype(np.float32),
        uvs=np.zeros((len(positions), 2), np.float32),
        material=sapien.render.RenderMaterial(base_color=list(rgba)),
    )


def _ring(radius: float, height: float) -> NDArray[np.float64]:
    """Return `SEGMENTS` points of a circle around the vertical axis, (SEGMENTS, 3), m.

    With a unit normal's parts for radius and height it returns normals.
    """
    angles = 2.0 * np.pi * np.arange(SEGMENTS) / SEGMENTS
    heights = np.full(SEGMENTS, height)
    return np.stack([radius * np.cos(angles), radius * np.sin(angles), heights], axis=1)


def _band_triangles(first: int) -> NDArray[np.intp]:
    """Return the triangles of a band, as vertex numbers, (2 * SEGMENTS, 3).

    Each segment is a quadrilateral of two triangles.

    Args:
        first: number of the first vertex; those of the second circle follow those of the first.
    """
    low = first + np.arange(SEGMENTS)
    next_low = first + np.roll(np.arange(SEGMENTS), -1)
    high = low + SEGMENTS
    next_high = next_low + SEGMENTS
    left_halves = np.stack([low, next_low, high], axis=1)
    right_halves = np.stack([next_low, next_high, high], axis=1)
    return np.concatenate([left_halves, right_halves])
