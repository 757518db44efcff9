"""Triangles that share corners are the same triangles."""

import itertools

import numpy as np

from roboirg.simulation.rendering.triangles import Triangles, duplicate_vertices, index_triangles


def octahedron():
    """Eight faces with six corners, on the axes at ±1, and a normal of its own for each face."""
    corners = []
    normals = []
    for x, y, z in itertools.product((-1, 1), repeat=3):
        corners.append([(x, 0, 0), (0, y, 0), (0, 0, z)])
        normals.append((x, y, z))
    return Triangles(np.float32(corners), np.float32(normals) / np.sqrt(3))


def test_an_octahedron_needs_as_many_vertices_as_it_has_normals():
    """Not 24, three for each of its eight faces; a mesh has a list of vertices that faces share."""
    shared = index_triangles(octahedron())

    assert len(shared.vertices) == 8


def test_sharing_vertices_keeps_each_triangle_and_its_normal():
    """A triangle may begin at another of its corners than before."""
    shared = index_triangles(octahedron()).to_triangles()

    assert np.array_equal(shared.normals, octahedron().normals)
    for kept, corners in zip(shared.corners, octahedron().corners, strict=True):
        turned = [np.roll(corners, turn, axis=0).tolist() for turn in range(3)]
        assert kept.tolist() in turned


def test_triangles_with_shared_vertices_can_get_their_own_again():
    shared = index_triangles(octahedron())

    own = duplicate_vertices(shared)

    assert len(own.vertices) == 24
    assert np.array_equal(own.to_triangles().corners, shared.to_triangles().corners)
    assert np.array_equal(own.to_triangles().normals, octahedron().normals)


def test_a_mesh_without_triangles_stays_one():
    nothing = Triangles(np.zeros((0, 3, 3), np.float32), np.zeros((0, 3), np.float32))

    shared = index_triangles(nothing)

    assert [len(field) for field in shared] == [0, 0, 0]
    assert len(duplicate_vertices(shared).to_triangles().corners) == 0
