"""The robot's meshes in a form that is fast to draw, derived from the installed files.

A mesh has parts, each with its material. The installed meshes are flat-shaded, with three vertices
for each triangle; the derived ones share vertices and are cached between processes as arrays with
the number of their part: ``vertices0``, ``normals0``, ``triangles0``, ``material0``, …
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from functools import partial
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
from roboirg.simulation.rendering.viewpoint import reach_pixels, to_front_camera, transformed

FINGER = "finger.glb"
"""Never simplified, because the wrist camera sees it from very near."""
LINK_SHARE = 0.1
CAMERA_SHARE = 0.05
"""Shares of triangles that light meshes keep; for the camera, of its visible triangles."""
MIN_TRIANGLES = 500
"""Parts with fewer triangles are not simplified."""

Numbers = tuple[float, ...]
"""A pose or a material as numbers, which can be hashed (SAPIEN's objects cannot).

A pose: position, quaternion. A material: emission (4 numbers), base color (4), specular, roughness,
metallic, transmission, index of refraction, roughness of transmission.
"""


class _InstalledPart(NamedTuple):
    """A part of an installed mesh.

    Attributes:
        triangles: those that can be visible.
        material: as numbers; () where the file has none.
    """

    triangles: Triangles
    material: Numbers


def _material_numbers(material: sapien.render.RenderMaterial) -> Numbers:
    """Return a material without textures as numbers; `_make_material` reads them."""
    return (
        *material.emission,
        *material.base_color,
        material.specular,
        material.roughness,
        material.metallic,
        material.transmission,
        material.ior,
        material.transmission_roughness,
    )


def _make_material(numbers: Numbers) -> sapien.render.RenderMaterial:
    """Return the material that `_material_numbers` has written down."""
    emission = numbers[:4]
    base_color = numbers[4:8]
    return sapien.render.RenderMaterial(emission, base_color, *numbers[8:])


def link_shapes(
    path: Path,
    material: sapien.render.RenderMaterial | None,
    rendering: RenderSettings,
    fixed_at: sapien.Pose | None = None,
) -> list[sapien.render.RenderShapeTriangleMesh]:
    """Return a link's shapes, to be attached to a body and posed.

    Args:
        path: the installed mesh.
        material: material for files without one; None for SAPIEN's default.
        rendering: faithful or light.
        fixed_at: pose of a mesh that never moves, in the world frame: only triangles that reach a
            pixel of the front camera are kept. None keeps all.
    """
    material_numbers: Numbers = ()
    if material is not None:
        material_numbers = _material_numbers(material)
    pose_numbers = None
    if fixed_at is not None:
        pose_numbers = (*fixed_at.p.tolist(), *fixed_at.q.tolist())
    shapes = _shapes(path, material_numbers, rendering, pose_numbers)
    return [shape.clone() for shape in shapes]


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
    default_material: Numbers,
    rendering: RenderSettings,
    fixed_at: Numbers | None,
) -> Sequence[sapien.render.RenderShapeTriangleMesh]:
    """Return the shapes of `link_shapes`, made once and shared by all worlds of the process.

    Arguments are as there, as numbers, because the cache needs what can be hashed.
    """
    arrays = _mesh_arrays(path, rendering)
    drawn = arrays
    if fixed_at is not None:
        drawn = _front_mesh_arrays(path, rendering, fixed_at)
    shapes = []
    for number, part in enumerate(_parts(drawn)):
        if not len(part.triangles):
            continue
        numbers = arrays[f"material{number}"].tolist() or default_material
        material = _make_material(numbers) if numbers else None
        mesh = part if rendering.slim_shader else duplicate_vertices(part)
        shape = sapien.render.RenderShapeTriangleMesh(
            vertices=mesh.vertices,
            triangles=mesh.triangles,
            normals=mesh.normals,
            uvs=np.zeros((len(mesh.vertices), 2), np.float32),
            material=material,
        )
        shapes.append(shape)
    return shapes


def _parts(arrays: Arrays) -> list[IndexedTriangles]:
    """Return the triangles of each part of a mesh; the reverse of `_numbered`."""
    parts: list[IndexedTriangles] = []
    while f"triangles{len(parts)}" in arrays:
        number = len(parts)
        fields = [arrays[f"{field}{number}"] for field in IndexedTriangles._fields]
        parts.append(IndexedTriangles._make(fields))
    return parts


def _numbered(part: IndexedTriangles, number: int) -> Arrays:
    """Return a part's arrays under names with its number, such as ``vertices0``; see `_parts`."""
    return {f"{field}{number}": array for field, array in part._asdict().items()}


def _mesh_arrays(path: Path, rendering: RenderSettings) -> Arrays:
    """Return the derived form of an installed mesh, from the cache if it is there.

    Each part has arrays with its number, such as ``vertices0``, ``normals0``, ``triangles0`` and
    ``material0`` (empty where the file has none). The entry ``hull`` has the vertices (n, 3) of the
    convex hull of all parts, m.
    """
    derive = partial(_derive_arrays, path, is_light=_is_light(path, rendering))
    return cached_arrays(_cache_name(path, rendering), _source_bytes(), derive)


def _derive_arrays(path: Path, *, is_light: bool) -> Arrays:
    """Make the arrays of `_mesh_arrays` from the installed file; light meshes are simplified."""
    arrays: Arrays = {}
    for number, part in enumerate(_read_installed_mesh(path)):
        triangles = part.triangles
        if is_light and len(triangles.corners) > MIN_TRIANGLES:
            share = CAMERA_SHARE if path.suffix == ".stl" else LINK_SHARE
            triangles = simplify(triangles.corners, share=share)
        arrays |= _numbered(index_triangles(triangles), number)
        arrays[f"material{number}"] = np.array(part.material, np.float32)
    # Importing SciPy takes a quarter of a second, and cached arrays do not need it.
    from scipy.spatial import ConvexHull

    points = np.concatenate([part.vertices for part in _parts(arrays)])
    arrays["hull"] = points[ConvexHull(points).vertices]
    return arrays


def _front_mesh_arrays(path: Path, rendering: RenderSettings, fixed_at: Numbers) -> Arrays:
    """Return the arrays of `_mesh_arrays`, with only what reaches a pixel of the front camera.

    The mesh is opaque and never moves. Materials and hull are left out.

    Args:
        path: the installed mesh.
        rendering: faithful or light.
        fixed_at: its pose in the world frame, as numbers.
    """
    name = f"{_cache_name(path, rendering)}-front"
    sources = _source_bytes() + source_code("viewpoint") + repr(fixed_at).encode()
    return cached_arrays(name, sources, partial(_derive_front_arrays, path, rendering, fixed_at))


def _derive_front_arrays(path: Path, rendering: RenderSettings, fixed_at: Numbers) -> Arrays:
    """Make the arrays of `_front_mesh_arrays` from those of the whole mesh."""
    pose = sapien.Pose(fixed_at[:3], fixed_at[3:])
    to_camera = to_front_camera(pose)
    arrays: Arrays = {}
    for number, part in enumerate(_parts(_mesh_arrays(path, rendering))):
        whole = part.to_triangles()
        is_shown = reach_pixels(transformed(whole.corners, to_camera))
        shown = Triangles(whole.corners[is_shown], whole.normals[is_shown])
        arrays |= _numbered(index_triangles(shown), number)
    return arrays


def _is_light(path: Path, rendering: RenderSettings) -> bool:
    """Return whether a mesh is drawn with fewer triangles than are visible."""
    return rendering.meshes == "light" and path.name != FINGER


def _cache_name(path: Path, rendering: RenderSettings) -> str:
    """Return the name of a mesh's cache entry, for example ``link0-faithful``."""
    meshes = "light" if _is_light(path, rendering) else "faithful"
    return f"{path.stem}-{meshes}"


def _source_bytes() -> bytes:
    """Return what determines derived meshes; the installed files are verified separately."""
    return source_code("robot_meshes", "triangles", "camera_mesh") + camera_mesh.packed_mask()


def _read_installed_mesh(path: Path) -> list[_InstalledPart]:
    """Return the parts of an installed mesh, each with what can be visible of it."""
    if path.suffix == ".stl":
        corners, normals = camera_mesh.visible_triangles(path)
        return [_InstalledPart(Triangles(corners, normals), ())]
    parts = []
    for part in sapien.render.RenderShapeTriangleMesh(str(path)).parts:
        corners = part.vertices[part.triangles]
        normals = part.get_vertex_normal()[part.triangles[:, 0]]
        material = _material_numbers(part.material)
        parts.append(_InstalledPart(Triangles(corners, normals), material))
    return parts


def simplify(corners: NDArray[np.float32], *, share: float) -> Triangles:
    """Return nearly the same shape with fewer triangles; those without area are left out.

    Args:
        corners: corners of the triangles, (n, 3, 3), meters.
        share: share of triangles to keep, 0 to 1.
    """
    with extra_needed("Light meshes need fast-simplification", "light"):
        import fast_simplification
    points, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    faces = faces.reshape(-1, 3).astype(np.int32)
    points, faces = fast_simplification.simplify(points, faces, target_reduction=1.0 - share)
    kept = points[faces].astype(np.float32)

    first_side = kept[:, 1] - kept[:, 0]
    second_side = kept[:, 2] - kept[:, 0]
    normals = np.cross(first_side, second_side)
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    has_area = sizes[:, 0] > 0
    unit_normals = normals[has_area] / sizes[has_area]
    return Triangles(kept[has_area], unit_normals.astype(np.float32))
