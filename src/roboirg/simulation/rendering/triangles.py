"""Flat-shaded triangles, with separate or shared vertices.

Computing vertices is most of the cost of drawing a mesh on a CPU. If a triangle's normal is that of
its first vertex (`roboirg.simulation.rendering.shaders`), the other two can be any vertices at
their positions.
"""

from __future__ import annotations

from collections.abc import Sequence
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
    """Let triangles share vertices, as few as possible; the triangles keep their order.

    Only the first vertex of a triangle needs its normal, so each of the others can be any vertex
    at the right position.
    """
    positions = _row_ids(flat.corners.reshape(-1, 3)).reshape(-1, 3).tolist()
    normals = _row_ids(flat.normals).tolist()
    vertices = _VertexList()
    first_corners = []
    for number, (corners, normal) in enumerate(zip(positions, normals, strict=True)):
        first_corners.append(vertices.begin_triangle(number, corners, normal))
    for number, corners in enumerate(positions):
        for corner, position in enumerate(corners):
            if position not in vertices.at:
                vertices.add(position, _TriangleCorner(number, corner))

    triangles = []
    for corners, normal, first in zip(positions, normals, first_corners, strict=True):
        vertex = vertices.with_normal[corners[first], normal]
        second = vertices.nearest(corners[(first + 1) % 3], vertex)
        third = vertices.nearest(corners[(first + 2) % 3], vertex)
        triangles.append([vertex, second, third])
    owners, corners_of_owners = np.array(vertices.sources, dtype=np.intp).reshape(-1, 2).T
    return IndexedTriangles(
        flat.corners[owners, corners_of_owners],
        flat.normals[owners],
        np.array(triangles, dtype=np.uint32).reshape(-1, 3),
    )


class _TriangleCorner(NamedTuple):
    """A corner (0 to 2) of a triangle, both by number."""

    triangle: int
    corner: int


class _VertexList:
    """The vertices that triangles share; positions and normals are ids of equal rows.

    Attributes:
        sources: the corner that each vertex is copied from, normal included.
        at: the vertices at each position.
        with_normal: a vertex for a position and a normal.
    """

    def __init__(self) -> None:
        self.sources: list[_TriangleCorner] = []
        self.at: dict[int, list[int]] = {}
        self.with_normal: dict[tuple[int, int], int] = {}

    def add(self, position: int, source: _TriangleCorner) -> None:
        """Add a vertex at a position."""
        self.at.setdefault(position, []).append(len(self.sources))
        self.sources.append(source)

    def begin_triangle(self, number: int, corners: Sequence[int], normal: int) -> int:
        """Return the corner that a triangle begins with, where a vertex has its normal.

        If there is none, one is added at the corner with the fewest vertices.

        Args:
            number: of the triangle.
            corners: positions of its corners.
            normal: of the triangle.
        """
        for corner, position in enumerate(corners):
            if (position, normal) in self.with_normal:
                return corner
        counts = [len(self.at.get(position, ())) for position in corners]
        fewest = counts.index(min(counts))
        self.with_normal[corners[fewest], normal] = len(self.sources)
        self.add(corners[fewest], _TriangleCorner(number, fewest))
        return fewest

    def nearest(self, position: int, vertex: int) -> int:
        """Return the vertex at a position whose number is nearest to that of another vertex.

        It is likely to be in the graphics processor's vertex cache as well.
        """
        return min(self.at[position], key=lambda candidate: abs(candidate - vertex))


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
