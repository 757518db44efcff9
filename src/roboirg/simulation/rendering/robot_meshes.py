"""The robot's meshes in a form that is fast to draw, derived from the installed files.

The installed meshes are flat-shaded, with three vertices for each triangle; the derived ones share
vertices and are cached between processes.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import sapien
import sapien.render
from numpy.typing import NDArray

from roboirg.core.extras import extra_needed
from roboirg.simulation.rendering import camera_mesh, shaders
from roboirg.simulation.rendering.mesh_cache import Arrays, cached_arrays, source_code
from roboirg.simulation.rendering.render_settings import RenderSettings
from roboirg.simulation.rendering.triangles import (
    IndexedTriangles,
    Triangles,
    duplicate_vertices,
    index_triangles,
)
from roboirg.simulation.rendering.viewpoint import reach_pixels, to_front_camera

FINGER = "finger.glb"
"""Never simplified, because the wrist camera sees it from very near."""
LINK_SHARE = 0.1
CAMERA_SHARE = 0.05
"""Shares of triangles to keep; for the camera, of its visible triangles."""
MIN_TRIANGLES = 500
"""Parts with fewer triangles are not simplified."""


class _PoseKey(NamedTuple):
    """A hashable pose in the world frame."""

    position: tuple[float, ...]
    quaternion: tuple[float, ...]


@dataclass(frozen=True)
class _MaterialKey:
    """A hashable material without textures."""

    emission: tuple[float, ...]
    base_color: tuple[float, ...]
    specular: float
    roughness: float
    metallic: float
    transmission: float
    ior: float
    transmission_roughness: float

    @classmethod
    def from_sapien(cls, material: sapien.render.RenderMaterial) -> _MaterialKey:
        return cls(
            tuple(material.emission),
            tuple(material.base_color),
            material.specular,
            material.roughness,
            material.metallic,
            material.transmission,
            material.ior,
            material.transmission_roughness,
        )

    def packed(self) -> NDArray[np.float32]:
        return np.array(np.hstack([*astuple(self)]), np.float32)

    @classmethod
    def unpacked(cls, numbers: NDArray[np.float32]) -> _MaterialKey:
        values = [float(number) for number in numbers]
        return cls(tuple(values[:4]), tuple(values[4:8]), *values[8:])

    def material(self) -> sapien.render.RenderMaterial:
        emission, base_color, *rest = astuple(self)
        return sapien.render.RenderMaterial(list(emission), list(base_color), *rest)


def link_shapes(
    path: Path,
    material: sapien.render.RenderMaterial | None,
    rendering: RenderSettings,
    fixed_at: sapien.Pose | None = None,
) -> list[sapien.render.RenderShapeTriangleMesh]:
    """Return a link's shapes, to be attached to a body and posed.

    Args:
        path: the installed mesh.
        material: material for files without one.
        rendering: faithful or light.
        fixed_at: fixed pose of the mesh in the world frame; keeps only what reaches a
            pixel of the front camera there.
    """
    material_key = None if material is None else _MaterialKey.from_sapien(material)
    pose_key = None
    if fixed_at is not None:
        pose_key = _PoseKey(*(tuple(map(float, numbers)) for numbers in (fixed_at.p, fixed_at.q)))
    return [shape.clone() for shape in _shapes(path, material_key, rendering, pose_key)]


@functools.cache
def link_hull(path: Path, rendering: RenderSettings) -> NDArray[np.float64]:
    """Return vertices (n, 3) of a link's convex hull, meters in the mesh's frame."""
    return np.asarray(_mesh_arrays(path, rendering)["hull"], np.float64)


def apply_shading(body: sapien.render.RenderBodyComponent, rendering: RenderSettings) -> None:
    """Set the shading of a body with `link_shapes`, once it is in a scene."""
    if rendering.slim_shader:
        shaders.enable_flat_shading(body)


@functools.cache
def _shapes(
    path: Path,
    default_material: _MaterialKey | None,
    rendering: RenderSettings,
    fixed_at: _PoseKey | None,
) -> Sequence[sapien.render.RenderShapeTriangleMesh]:
    arrays = _mesh_arrays(path, rendering)
    drawn = arrays if fixed_at is None else _front_mesh_arrays(path, rendering, fixed_at)
    shapes = []
    for number, part in enumerate(_parts(drawn)):
        if not len(part.triangles):
            continue
        numbers = arrays[f"material{number}"]
        vertices, normals, triangles = part if rendering.slim_shader else duplicate_vertices(part)
        own = (
            _MaterialKey.unpacked(np.asarray(numbers, np.float32))
            if len(numbers)
            else default_material
        )
        shapes.append(
            sapien.render.RenderShapeTriangleMesh(
                vertices=vertices,
                triangles=triangles,
                normals=normals,
                uvs=np.zeros((len(vertices), 2), np.float32),
                material=None if own is None else own.material(),
            )
        )
    return shapes


def _parts(arrays: Arrays) -> list[IndexedTriangles]:
    """Return the triangles of each part of a mesh."""
    count = sum(name.startswith("triangles") for name in arrays)
    return [
        IndexedTriangles._make(arrays[f"{field}{part}"] for field in IndexedTriangles._fields)
        for part in range(count)
    ]


def _mesh_arrays(path: Path, rendering: RenderSettings) -> Arrays:
    """Return the fields of `IndexedTriangles` and the material of each part, suffixed by its index.

    The entry ``hull`` is the convex hull of all parts.
    """
    light = _is_light(path, rendering)

    def derive() -> Arrays:
        arrays: Arrays = {}
        for part, (flat, material) in enumerate(_read_installed_mesh(path)):
            share = CAMERA_SHARE if path.suffix == ".stl" else LINK_SHARE
            lighter = light and len(flat.corners) > MIN_TRIANGLES
            drawn = Triangles(*simplify(flat.corners, share=share)) if lighter else flat
            arrays |= _numbered(index_triangles(drawn), part)
            arrays[f"material{part}"] = np.zeros(0) if material is None else material.packed()
        points = np.concatenate([part.vertices for part in _parts(arrays)])
        # Importing SciPy takes a quarter of a second, and cached arrays do not need it.
        from scipy.spatial import ConvexHull

        arrays["hull"] = points[ConvexHull(points).vertices]
        return arrays

    return cached_arrays(_cache_name(path, rendering), _source_bytes(), derive)


def _front_mesh_arrays(path: Path, rendering: RenderSettings, fixed_at: _PoseKey) -> Arrays:
    """Return the fields of `IndexedTriangles` of each part that reach a pixel of the front camera.

    The mesh is opaque and never moves.
    """

    def derive() -> Arrays:
        to_camera = to_front_camera(sapien.Pose(fixed_at.position, fixed_at.quaternion))
        parts = [part.to_triangles() for part in _parts(_mesh_arrays(path, rendering))]
        corners = np.concatenate([part.corners for part in parts])
        shown = reach_pixels(corners @ to_camera[:3, :3].T + to_camera[:3, 3])
        ends = np.cumsum([len(part.corners) for part in parts])[:-1]
        arrays: Arrays = {}
        for number, (part, mask) in enumerate(zip(parts, np.split(shown, ends), strict=True)):
            seen = Triangles(part.corners[mask], part.normals[mask])
            arrays |= _numbered(index_triangles(seen), number)
        return arrays

    sources = _source_bytes() + source_code("viewpoint") + repr(fixed_at).encode()
    return cached_arrays(f"{_cache_name(path, rendering)}-front", sources, derive)


def _is_light(path: Path, rendering: RenderSettings) -> bool:
    return rendering.meshes == "light" and path.name != FINGER


def _cache_name(path: Path, rendering: RenderSettings) -> str:
    """Return the name of a mesh's cache entry."""
    return f"{path.stem}-{'light' if _is_light(path, rendering) else 'faithful'}"


def _source_bytes() -> bytes:
    """Return what determines derived meshes; the installed files are verified separately."""
    return source_code("robot_meshes", "triangles", "camera_mesh") + camera_mesh.packed_mask()


def _numbered(part: IndexedTriangles, number: int) -> Arrays:
    return {f"{field}{number}": array for field, array in part._asdict().items()}


def _read_installed_mesh(path: Path) -> list[tuple[Triangles, _MaterialKey | None]]:
    """Return the visible parts of an installed mesh with their materials."""
    if path.suffix == ".stl":
        return [(Triangles(*camera_mesh.visible_triangles(path)), None)]
    return [
        (
            Triangles(
                part.vertices[part.triangles], part.get_vertex_normal()[part.triangles[:, 0]]
            ),
            _MaterialKey.from_sapien(part.material),
        )
        for part in sapien.render.RenderShapeTriangleMesh(str(path)).parts
    ]


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
