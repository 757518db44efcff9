"""The wrist camera's mesh without the triangles that nobody can ever see.

The installed model of the camera is a full CAD model with lenses, threads and screws inside:
425,160 triangles, three quarters of all that a picture of the arm would draw. Which of them can be
seen from outside is shipped as a bit mask over the installed file's triangles; the mesh itself is
read from where it is installed (`roboirg.simulation.model_files` checks that it is the right one).
The mask is made by ``scripts/visible-triangles``.
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
    """The triangles of a binary STL file: records with a normal and three corners, meters."""
    data = path.read_bytes()
    count = int.from_bytes(data[STL_HEADER : STL_HEADER + 4], "little")
    return np.frombuffer(data, STL_TRIANGLE, count, offset=STL_HEADER + 4)


def packed_mask() -> bytes:
    """The bit mask as it is shipped."""
    return resources.files("roboirg.simulation.rendering").joinpath(MASK_FILE).read_bytes()


def visible_mask(count: int) -> NDArray[np.bool_]:
    """For each of the file's triangles whether it can be seen from outside."""
    packed = zlib.decompress(packed_mask())
    return np.unpackbits(np.frombuffer(packed, np.uint8), count=count).astype(bool)


def visible_triangles(stl: Path) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Corners (n, 3, 3) and normals (n, 3) of the triangles that can be seen."""
    triangles = read_stl(stl)
    seen = triangles[visible_mask(len(triangles))]
    return np.ascontiguousarray(seen["corners"]), np.ascontiguousarray(seen["normal"])
