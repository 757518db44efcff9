"""Mesh simplification, for pictures that may differ slightly from the faithful ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from roboirg.core.extras import extra_needed

LINK_SHARE = 0.1
CAMERA_SHARE = 0.05
"""Shares of triangles to keep; for the camera, of its visible triangles."""
MIN_TRIANGLES = 500
"""Parts with fewer triangles are not simplified."""


def simplify(
    corners: NDArray[np.float32], *, share: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return nearly the same shape with fewer triangles.

    Args:
        corners: corners of the triangles, (n, 3, 3), meters.
        share: share of triangles to keep.

    Returns:
        Corners (m, 3, 3) and normals (m, 3).
    """
    with extra_needed("Light meshes need fast-simplification", "light"):
        import fast_simplification
    points, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    points, faces = fast_simplification.simplify(
        points, faces.reshape(-1, 3).astype(np.int32), target_reduction=1.0 - share
    )
    kept = points[faces].astype(np.float32)
    normals = np.cross(kept[:, 1] - kept[:, 0], kept[:, 2] - kept[:, 0])
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    whole = sizes[:, 0] > 0
    return kept[whole], (normals[whole] / sizes[whole]).astype(np.float32)
