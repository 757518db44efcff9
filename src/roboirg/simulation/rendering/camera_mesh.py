"""The wrist camera's mesh without triangles that are never visible.

The installed model of the camera is a full CAD model with lenses, threads and screws inside:
425,160 triangles, three quarters of all triangles in a picture of the arm. A shipped bit mask over
the installed file's triangles selects those visible from outside; the mesh itself is read from its
installed location (`roboirg.simulation.model_files` verifies it). ``scripts/visible-triangles``
creates the mask.
"""

from __future__ import annotations

import zlib
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

MASK_FILE = "wrist_camera_visible.bin"

STL_HEADER = 80
STL_TRIANGLE = np.dtype(
    [("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attributes", "<u2")]
)


def read_stl(path: Path) -> NDArray[np.void]:
    """Read a binary STL file as records with a normal and three corners, meters."""
    data = path.read_bytes()
    count = int.from_bytes(data[STL_HEADER : STL_HEADER + 4], "little")
    return np.frombuffer(data, STL_TRIANGLE, count, offset=STL_HEADER + 4)


def packed_mask() -> bytes:
    """Return the shipped bit mask, compressed by zlib; `visible_triangles` unpacks it."""
    return resources.files("roboirg.simulation.rendering").joinpath(MASK_FILE).read_bytes()


def visible_triangles(stl: Path) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return corners (n, 3, 3), m, and normals (n, 3) of the triangles visible from outside."""
    triangles = read_stl(stl)
    bits = np.frombuffer(zlib.decompress(packed_mask()), np.uint8)
    is_visible = np.unpackbits(bits, count=len(triangles)).astype(bool)  # a bit for each triangle
    visible = triangles[is_visible]
    return np.ascontiguousarray(visible["corners"]), np.ascontiguousarray(visible["normal"])
