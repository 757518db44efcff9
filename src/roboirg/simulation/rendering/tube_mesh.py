"""The mesh of a tube, which draws a roll of tape; SAPIEN's own shapes have no holes."""

from __future__ import annotations

import functools

import numpy as np
import sapien
import sapien.render

Rgba = tuple[float, float, float, float]

SEGMENTS = 48


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
    # Four bands between two circles each: outside, top, inside, bottom; edges are sharp.
    circles = [(outer, -half), (outer, half), (inner, half), (inner, -half)]
    slopes = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]
    angles = 2.0 * np.pi * np.arange(SEGMENTS) / SEGMENTS
    cos, sin = np.cos(angles), np.sin(angles)
    vertices, normals, triangles = [], [], []
    start, end = np.arange(SEGMENTS), np.roll(np.arange(SEGMENTS), -1)
    for band, (away, up) in enumerate(slopes):
        for radius, height in (circles[band], circles[(band + 1) % 4]):
            vertices.append(np.stack([radius * cos, radius * sin, np.full(SEGMENTS, height)], 1))
            normals.append(np.stack([away * cos, away * sin, np.full(SEGMENTS, up)], 1))
        low = 2 * band * SEGMENTS
        high = low + SEGMENTS
        triangles += [
            np.stack([low + start, low + end, high + start], 1),
            np.stack([low + end, high + end, high + start], 1),
        ]
    return sapien.render.RenderShapeTriangleMesh(
        vertices=np.concatenate(vertices).astype(np.float32),
        triangles=np.concatenate(triangles).astype(np.uint32),
        normals=np.concatenate(normals).astype(np.float32),
        uvs=np.zeros((8 * SEGMENTS, 2), np.float32),
        material=sapien.render.RenderMaterial(base_color=list(rgba)),
    )
