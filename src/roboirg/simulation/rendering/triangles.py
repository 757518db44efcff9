"""Flat-shaded triangles, with separate or shared vertices.

Computing vertices is most of the cost of drawing a mesh on a CPU. If a triangle's normal is that of
its first vertex (`roboirg.simulation.rendering.shaders`), the other two can be any vertices at
their positions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Triangles(NamedTuple):
    """Flat-shaded triangles with separate corners.

    Attributes:
        corners: (n, 3, 3), meters.
        normals: (n, 3).
    """

    corners: NDArray[np.float32]
    normals: NDArray[np.float32]


class IndexedTriangles(NamedTuple):
    """Triangles that share vertices; the normal of each is that of its first vertex.

    Attributes:
        vertices: (m, 3), meters.
        normals: (m, 3).
        triangles: (n, 3), vertex indices.
    """

    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    triangles: NDArray[np.uint32]

    def to_triangles(self) -> Triangles:
        """Return the triangles with separate corners."""
        return Triangles(self.vertices[self.triangles], self.normals[self.triangles[:, 0]])


def index_triangles(flat: Triangles) -> IndexedTriangles:
    """Index the triangles with few vertices, keeping their order."""
    places = _row_ids(flat.corners.reshape(-1, 3)).reshape(-1, 3).tolist()
    ways = _row_ids(flat.normals).tolist()
    at: dict[int, list[int]] = {}
    vertex_of: dict[tuple[int, int], int] = {}
    sources: list[tuple[int, int]] = []
    firsts = []
    for number, (three, way) in enumerate(zip(places, ways, strict=True)):
        # Use a vertex with this normal, or add one where there are the fewest.
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
        # Nearby vertices are likely to be in the vertex cache.
        others = [
            min(at[three[(first + k) % 3]], key=lambda vertex: abs(vertex - here)) for k in (1, 2)
        ]
        triangles.append([here, *others])
    owners, corners = np.array(sources, dtype=np.intp).reshape(-1, 2).T
    return IndexedTriangles(
        flat.corners[owners, corners],
        flat.normals[owners],
        np.array(triangles, dtype=np.uint32).reshape(-1, 3),
    )


def duplicate_vertices(indexed: IndexedTriangles) -> IndexedTriangles:
    """Return the same triangles with three separate vertices each."""
    corners, normals = indexed.to_triangles()
    count = 3 * len(corners)
    return IndexedTriangles(
        corners.reshape(-1, 3),
        np.repeat(normals, 3, axis=0),
        np.arange(count, dtype=np.uint32).reshape(-1, 3),
    )


def _row_ids(rows: NDArray[np.float32]) -> NDArray[np.intp]:
    """Return an id for each row, equal for equal rows."""
    return np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)
