"""Flat-shaded triangles, with separate or shared vertices.

A vertex is a position with a normal; a corner is one of the three points of a triangle. Computing
vertices is most of the cost of drawing a mesh on a CPU. If a triangle's normal is that of its first
vertex (`roboirg.simulation.rendering.shaders`), the other two can be any vertices at their
positions, so triangles with different normals can share them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Triangles(NamedTuple):
    """n flat-shaded triangles with separate corners.

    Attributes:
        corners: (n, 3, 3) three points each, meters.
        normals: (n, 3) unit vectors.
    """

    corners: NDArray[np.float32]
    normals: NDArray[np.float32]


class IndexedTriangles(NamedTuple):
    """n triangles that share m vertices; the normal of a triangle is that of its first vertex.

    Attributes:
        vertices: (m, 3) positions, meters.
        normals: (m, 3) unit vectors.
        triangles: (n, 3) indices into both.
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
    at the right position. A triangle may begin at another corner than before.
    """
    positions = _row_ids(flat.corners.reshape(-1, 3)).reshape(-1, 3).tolist()
    normals = _row_ids(flat.normals).tolist()
    vertices = _VertexList()
    # First the vertices that have the normals of triangles, then those that are still missing.
    firsts = []
    for number, (corners, normal) in enumerate(zip(positions, normals, strict=True)):
        firsts.append(vertices.begin_triangle(number, corners, normal))
    for number, corners in enumerate(positions):
        for corner, position in enumerate(corners):
            if position not in vertices.at:
                vertices.add(position, _TriangleCorner(number, corner))

    triangles = []
    for corners, normal, first in zip(positions, normals, firsts, strict=True):
        triangles.append(vertices.vertices_of(corners, normal, first))
    sources = np.array(vertices.sources, dtype=np.intp).reshape(-1, 2)
    return IndexedTriangles(
        flat.corners[sources[:, 0], sources[:, 1]],
        flat.normals[sources[:, 0]],
        np.array(triangles, dtype=np.uint32).reshape(-1, 3),
    )


class _TriangleCorner(NamedTuple):
    """A corner (0 to 2) of a triangle, both by number."""

    triangle: int
    corner: int


class _VertexList:
    """The vertices that triangles share, numbered in the order in which they are added.

    Positions and normals are given as ids; equal ones have the same id (`_row_ids`).

    Attributes:
        sources: of each vertex, the corner that position and normal are copied from.
        at: the vertices at each position.
        with_normal: the vertex for a position and a normal.
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
        """Choose the corner (0 to 2) that a triangle begins with, where a vertex has its normal.

        If no corner has such a vertex, one is added at the corner with the fewest vertices: each
        position needs one in the end. The first triangle begins with corner 0; another one in the
        same plane, which shares that position, begins there, too, and adds none. `vertices_of` is
        called later with the corner that is returned.

        Args:
            number: of the triangle.
            corners: (3,) ids of the positions of its corners.
            normal: id of its normal.
        """
        for corner, position in enumerate(corners):
            if (position, normal) in self.with_normal:
                return corner
        counts = [len(self.at.get(position, ())) for position in corners]
        begin = counts.index(min(counts))
        # `add` numbers the new vertex by the sources so far, so note its number before.
        self.with_normal[corners[begin], normal] = len(self.sources)
        self.add(corners[begin], _TriangleCorner(number, begin))
        return begin

    def vertices_of(self, corners: Sequence[int], normal: int, first: int) -> list[int]:
        """Return the numbers of the three vertices of a triangle, in its order of corners.

        A triangle that begins with corner 2 gets vertices at its corners 2, 0 and 1, so that it
        still faces the same side. Only the first must have its normal; of those at the position
        of each other corner it takes the one with the nearest number to the first, which is likely
        to be in the graphics processor's vertex cache as well.

        Needs a vertex at every position, so all triangles must have begun before.

        Args:
            corners: (3,) ids of the positions of its corners.
            normal: id of its normal.
            first: the corner that it begins with, 0 to 2, as `begin_triangle` returned it.
        """
        first_vertex = self.with_normal[corners[first], normal]

        def distance(vertex: int) -> int:
            return abs(vertex - first_vertex)

        second = corners[(first + 1) % 3]
        third = corners[(first + 2) % 3]
        return [
            first_vertex,
            min(self.at[second], key=distance),
            min(self.at[third], key=distance),
        ]


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
    """Return an id for each row, equal for equal rows: [[0, 1], [5, 2], [0, 1]] → [0, 1, 0]."""
    return np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)
