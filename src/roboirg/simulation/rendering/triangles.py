"""Triangles that are shaded flat, with corners of their own or with shared ones.

Computing corners is most of what drawing a mesh costs on a processor. Where a triangle's normal is
that of its first corner (`roboirg.simulation.rendering.shaders`), the other two can be any corners
at their places.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Triangles(NamedTuple):
    """Triangles that are shaded flat.

    Attributes:
        corners: (n, 3, 3), meters.
        normals: (n, 3).
    """

    corners: NDArray[np.float32]
    normals: NDArray[np.float32]


class Shared(NamedTuple):
    """Triangles that share corners; the normal of each is that of its first corner.

    Attributes:
        vertices: (m, 3), meters.
        normals: (m, 3).
        triangles: (n, 3), indices of vertices.
    """

    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    triangles: NDArray[np.uint32]

    def flattened(self) -> Triangles:
        """The same with their own corners."""
        return Triangles(self.vertices[self.triangles], self.normals[self.triangles[:, 0]])


def share_corners(flat: Triangles) -> Shared:
    """Few vertices for all triangles, in the triangles' order."""
    places = _numbers_of(flat.corners.reshape(-1, 3)).reshape(-1, 3).tolist()
    ways = _numbers_of(flat.normals).tolist()
    at: dict[int, list[int]] = {}
    vertex_of: dict[tuple[int, int], int] = {}
    sources: list[tuple[int, int]] = []
    firsts = []
    for number, (three, way) in enumerate(zip(places, ways, strict=True)):
        # A vertex with this normal, or one more where there are the fewest.
        first = min(
            range(3),
            key=lambda k: -1 if (three[k], way) in vertex_of else len(at.get(three[k], ())),
        )
        if (three[first], way) not in vertex_of:
            vertex_of[three[first], way] = len(sources)
            at.setdefault(three[first], []).append(len(sources))
            sources.append((number, first))
        firsts.append(first)
    for number, three in enumerate(places):
        for corner, place in enumerate(three):
            if place not in at:
                at[place] = [len(sources)]
                sources.append((number, corner))
    triangles = []
    for three, way, first in zip(places, ways, firsts, strict=True):
        here = vertex_of[three[first], way]
        # What has been computed lately need not be computed again.
        others = [
            min(at[three[(first + k) % 3]], key=lambda vertex: abs(vertex - here)) for k in (1, 2)
        ]
        triangles.append([here, *others])
    owners, corners = np.array(sources, dtype=np.intp).reshape(-1, 2).T
    return Shared(
        flat.corners[owners, corners],
        flat.normals[owners],
        np.array(triangles, dtype=np.uint32).reshape(-1, 3),
    )


def unshare_corners(shared: Shared) -> Shared:
    """The same with three vertices of its own for each triangle."""
    corners, normals = shared.flattened()
    count = 3 * len(corners)
    return Shared(
        corners.reshape(-1, 3),
        np.repeat(normals, 3, axis=0),
        np.arange(count, dtype=np.uint32).reshape(-1, 3),
    )


def _numbers_of(rows: NDArray[np.float32]) -> NDArray[np.intp]:
    """A number for each row, equal for equal rows."""
    return np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)
