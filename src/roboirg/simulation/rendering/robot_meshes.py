"""The robot's meshes in a form that is fast to draw, derived from the installed files.

The installed meshes are flat-shaded, with three vertices for each triangle; the derived ones share
vertices and are cached between processes.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path

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


Numbers = tuple[float, ...]
"""Of a pose: position, quaternion. Of a material: emission, base color, specular, roughness,
metallic, transmission, index of refraction, roughness of transmission. Both can be hashed."""


def _numbers_of(material: sapien.render.RenderMaterial) -> Numbers:
    """Return a material without textures as numbers."""
    rest = (material.specular, material.roughness, material.metallic, material.transmission)
    last = (material.ior, material.transmission_roughness)
    return (*map(float, material.emission), *map(float, material.base_color), *rest, *last)


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
    material_key = None if material is None else _numbers_of(material)
    pose_key = None
    if fixed_at is not None:
        pose_key = (*map(float, fixed_at.p), *map(float, fixed_at.q))
    return [shape.clone() for shape in _shapes(path, material_key, rendering, pose_key)]


@functools.cache
def link_hull(path: Path, rendering: RenderSettings) -> NDArray[np.float64]:
    """Return vertices (n, 3) of a link's convex hull, meters in the mesh's frame."""
    return np.asarray(_mesh_arrays(path, rendering)["hull"], np.float64)


def apply_shading(body: sapien.render.RenderBodyComponent, rendering: RenderSettings) -> None:
    """Set the shading of a body with `link_shapes`, once it is in a scene.

    The slim shader shades each triangle by the normal of its first vertex.
    """
    if rendering.slim_shader:
        body.set_property(shaders.SHADING, shaders.FIRST_CORNER)


@functools.cache
def _shapes(
    path: Path,
    default_material: Numbers | None,
    rendering: RenderSettings,
    fixed_at: Numbers | None,
) -> Sequence[sapien.render.RenderShapeTriangleMesh]:
    arrays = _mesh_arrays(path, rendering)
    drawn = arrays if fixed_at is None else _front_mesh_arrays(path, rendering, fixed_at)
    shapes = []
    for number, part in enumerate(_parts(drawn)):
        if not len(part.triangles):
            continue
        own = arrays[f"material{number}"].tolist() or default_material
        vertices, normals, triangles = part if rendering.slim_shader else duplicate_vertices(part)
        shapes.append(
            sapien.render.RenderShapeTriangleMesh(
                vertices=vertices,
                triangles=triangles,
                normals=normals,
                uvs=np.zeros((len(vertices), 2), np.float32),
                material=own and sapien.render.RenderMaterial(own[:4], own[4:8], *own[8:]),
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
            arrays[f"material{part}"] = np.array(material, np.float32)
        points = np.concatenate([part.vertices for part in _parts(arrays)])
        # Importing SciPy takes a quarter of a second, and cached arrays do not need it.
        from scipy.spatial import ConvexHull

        arrays["hull"] = points[ConvexHull(points).vertices]
        return arrays

    return cached_arrays(_cache_name(path, rendering), _source_bytes(), derive)


def _front_mesh_arrays(path: Path, rendering: RenderSettings, fixed_at: Numbers) -> Arrays:
    """Return the fields of `IndexedTriangles` of each part that reach a pixel of the front camera.

    The mesh is opaque and never moves.
    """

    def derive() -> Arrays:
        to_camera = to_front_camera(sapien.Pose(fixed_at[:3], fixed_at[3:]))
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


def _read_installed_mesh(path: Path) -> list[tuple[Triangles, Numbers]]:
    """Return the visible parts of an installed mesh with their materials; of STL without."""
    if path.suffix == ".stl":
        return [(Triangles(*camera_mesh.visible_triangles(path)), ())]
    return [
        (
            Triangles(
                part.vertices[part.triangles], part.get_vertex_normal()[part.triangles[:, 0]]
            ),
            _numbers_of(part.material),
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
