"""Triangles that share corners are the same triangles."""

import numpy as np

from roboirg.simulation.rendering.triangles import Triangles, duplicate_vertices, index_triangles


def triangles_of_hills():
    """Triangles over a grid of points with uneven heights."""
    ticks = np.arange(6.0)
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    heights = np.random.default_rng(0).random(x.shape).round(1)
    points = np.stack([x, y, heights], axis=-1).astype(np.float32)
    halves = [(points[:-1, :-1], points[1:, :-1], points[:-1, 1:])]
    halves += [(points[1:, :-1], points[1:, 1:], points[:-1, 1:])]
    corners = np.concatenate([np.stack(half, axis=2).reshape(-1, 3, 3) for half in halves])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return Triangles(corners, normals)


def test_sharing_corners_keeps_each_triangle_and_its_normal():
    """A mesh lists three corners for each triangle, or shared corners and their numbers."""
    corners, normals = triangles_of_hills()
    shared = index_triangles(triangles_of_hills())

    assert np.array_equal(shared.normals[shared.triangles[:, 0]], normals)
    for given, kept in zip(corners, shared.vertices[shared.triangles], strict=True):
        assert any(np.array_equal(np.roll(given, turn, axis=0), kept) for turn in range(3))
    assert len(shared.vertices) < 0.5 * 3 * len(corners)


def test_triangles_with_shared_corners_can_get_their_own_again():
    shared = index_triangles(triangles_of_hills())
    own = duplicate_vertices(shared)

    assert len(own.vertices) == 3 * len(own.triangles)
    assert np.array_equal(own.to_triangles().corners, shared.to_triangles().corners)
    assert np.array_equal(own.to_triangles().normals, triangles_of_hills().normals)


def test_a_mesh_without_triangles_needs_no_special_case():
    nothing = Triangles(np.zeros((0, 3, 3), np.float32), np.zeros((0, 3), np.float32))
    shared = index_triangles(nothing)

    assert [len(field) for field in shared] == [0, 0, 0]
    assert len(duplicate_vertices(shared).to_triangles().corners) == 0
