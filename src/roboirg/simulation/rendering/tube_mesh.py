"""A ring as a mesh: what a roll of tape looks like. SAPIEN's own shapes have no holes."""

from __future__ import annotations

import functools

import numpy as np
import sapien
import sapien.render

Rgba = tuple[float, float, float, float]

SEGMENTS = 48


def tube(
    outer: float, inner: float, half: float, rgba: Rgba
) -> sapien.render.RenderShapeTriangleMesh:
    """An upright ring about the origin, to be attached to a body.

    Args:
        outer: radius, m.
        inner: radius of the hole, m.
        half: half its height, m.
        rgba: color, 0 to 1 each.
    """
    return _ring(outer, inner, half, rgba).clone()


@functools.cache
def _ring(
    outer: float, inner: float, half: float, rgba: Rgba
) -> sapien.render.RenderShapeTriangleMesh:
    # Four bands, each between two circles: outside, top, inside, bottom; edges are sharp.
    circles = [(outer, -half), (outer, half), (inner, half), (inner, -half)]
    slopes = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]
    angles = 2.0 * np.pi * np.arange(SEGMENTS) / SEGMENTS
    cos, sin = np.cos(angles), np.sin(angles)
    vertices, normals, triangles = [], [], []
    here, there = np.arange(SEGMENTS), np.roll(np.arange(SEGMENTS), -1)
    for band, (away, up) in enumerate(slopes):
        for radius, height in (circles[band], circles[(band + 1) % 4]):
            vertices.append(np.stack([radius * cos, radius * sin, np.full(SEGMENTS, height)], 1))
            normals.append(np.stack([away * cos, away * sin, np.full(SEGMENTS, up)], 1))
        low = 2 * band * SEGMENTS
        high = low + SEGMENTS
        triangles += [
            np.stack([low + here, low + there, high + here], 1),
            np.stack([low + there, high + there, high + here], 1),
        ]
    return sapien.render.RenderShapeTriangleMesh(
        vertices=np.concatenate(vertices).astype(np.float32),
        triangles=np.concatenate(triangles).astype(np.uint32),
        normals=np.concatenate(normals).astype(np.float32),
        uvs=np.zeros((8 * SEGMENTS, 2), np.float32),
        material=sapien.render.RenderMaterial(base_color=list(rgba)),
    )
