"""The robot's meshes in a form that is quick to draw, derived from the installed files.

The installed meshes are shaded flat, with three corners of its own for each triangle; ours share
them. What is derived is kept between processes.
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

from roboirg.simulation.rendering import camera_mesh, shaders
from roboirg.simulation.rendering.mesh_cache import Arrays, cached_arrays, source_code
from roboirg.simulation.rendering.mesh_simplification import (
    CAMERA_SHARE,
    LINK_SHARE,
    SMALL,
    lighten,
)
from roboirg.simulation.rendering.occlusion import shown_triangles
from roboirg.simulation.rendering.render_mode import Rendering
from roboirg.simulation.rendering.triangles import Shared, Triangles, share_corners, unshare_corners
from roboirg.simulation.rendering.viewpoint import to_front_camera

FINGER = "finger.glb"
"""Seen from so near by the wrist camera that it is never lightened."""


class _Place(NamedTuple):
    """A pose in the world, by which shapes can be remembered."""

    position: tuple[float, ...]
    quaternion: tuple[float, ...]


@dataclass(frozen=True)
class _Look:
    """What there is to say of a material without textures."""

    emission: tuple[float, ...]
    base_color: tuple[float, ...]
    specular: float
    roughness: float
    metallic: float
    transmission: float
    ior: float
    transmission_roughness: float

    @classmethod
    def of(cls, material: sapien.render.RenderMaterial) -> _Look:
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
    def unpacked(cls, numbers: NDArray[np.float32]) -> _Look:
        values = [float(number) for number in numbers]
        return cls(tuple(values[:4]), tuple(values[4:8]), *values[8:])

    def material(self) -> sapien.render.RenderMaterial:
        emission, base_color, *rest = astuple(self)
        return sapien.render.RenderMaterial(list(emission), list(base_color), *rest)


def link_shapes(
    path: Path,
    material: sapien.render.RenderMaterial | None,
    rendering: Rendering,
    seen_at: sapien.Pose | None = None,
) -> list[sapien.render.RenderShapeTriangleMesh]:
    """A link's shapes, to be attached to a body and placed.

    Args:
        path: the installed mesh.
        material: for files that have none.
        rendering: faithful or light.
        seen_at: where the mesh is for ever, world frame, if only what the front camera can see
            of it there is wanted.
    """
    look = None if material is None else _Look.of(material)
    place = None
    if seen_at is not None:
        place = _Place(*(tuple(map(float, numbers)) for numbers in (seen_at.p, seen_at.q)))
    return [shape.clone() for shape in _shapes(path, look, rendering, place)]


@functools.cache
def link_hull(path: Path, rendering: Rendering) -> NDArray[np.float64]:
    """Vertices (n, 3) of a link's convex hull, meters in the mesh's frame."""
    return np.asarray(_derived(path, rendering)["hull"], np.float64)


def finish(body: sapien.render.RenderBodyComponent, rendering: Rendering) -> None:
    """Have a body of `link_shapes` that is in a scene shaded as they want it."""
    if _flat(rendering):
        shaders.mark(body)


def _flat(rendering: Rendering) -> bool:
    return rendering.slim_shader and shaders.slim_shader() is not None


@functools.cache
def _shapes(
    path: Path, look: _Look | None, rendering: Rendering, place: _Place | None
) -> Sequence[sapien.render.RenderShapeTriangleMesh]:
    arrays = _derived(path, rendering)
    drawn = arrays if place is None else _derived_for_front(path, rendering, place)
    shapes = []
    for number, part in enumerate(_parts(drawn)):
        if not len(part.triangles):
            continue
        numbers = arrays[f"look{number}"]
        vertices, normals, triangles = part if _flat(rendering) else unshare_corners(part)
        own = _Look.unpacked(np.asarray(numbers, np.float32)) if len(numbers) else look
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


def _parts(arrays: Arrays) -> list[Shared]:
    """The triangles of each part of a mesh, of what has been derived."""
    count = sum(name.startswith("triangles") for name in arrays)
    return [
        Shared._make(arrays[f"{field}{part}"] for field in Shared._fields) for part in range(count)
    ]


def _derived(path: Path, rendering: Rendering) -> Arrays:
    """For each part of a mesh the fields of `Shared` and the look, each with the part's number.

    Besides them the convex hull of all parts together.
    """
    light = _is_light(path, rendering)

    def derive() -> Arrays:
        arrays: Arrays = {}
        for part, (flat, look) in enumerate(_installed(path)):
            share = CAMERA_SHARE if path.suffix == ".stl" else LINK_SHARE
            lighter = light and len(flat.corners) > SMALL
            drawn = Triangles(*lighten(flat.corners, share=share)) if lighter else flat
            arrays |= _numbered(share_corners(drawn), part)
            arrays[f"look{part}"] = np.zeros(0) if look is None else look.packed()
        points = np.concatenate([part.vertices for part in _parts(arrays)])
        # SciPy takes a quarter of a second to import, and this is needed once.
        from scipy.spatial import ConvexHull

        arrays["hull"] = points[ConvexHull(points).vertices]
        return arrays

    return cached_arrays(_name(path, rendering), _sources(), derive)


def _derived_for_front(path: Path, rendering: Rendering, place: _Place) -> Arrays:
    """The fields of `Shared` with the numbers of the parts, of what the front camera can see.

    The mesh is opaque and in one place for ever.
    """

    def derive() -> Arrays:
        to_camera = to_front_camera(sapien.Pose(place.position, place.quaternion))
        parts = [part.flattened() for part in _parts(_derived(path, rendering))]
        corners = np.concatenate([part.corners for part in parts])
        shown = shown_triangles(corners @ to_camera[:3, :3].T + to_camera[:3, 3])
        ends = np.cumsum([len(part.corners) for part in parts])[:-1]
        arrays: Arrays = {}
        for number, (part, mask) in enumerate(zip(parts, np.split(shown, ends), strict=True)):
            seen = Triangles(part.corners[mask], part.normals[mask])
            arrays |= _numbered(share_corners(seen), number)
        return arrays

    sources = _sources() + source_code("occlusion", "viewpoint") + repr(place).encode()
    return cached_arrays(f"{_name(path, rendering)}-front", sources, derive)


def _is_light(path: Path, rendering: Rendering) -> bool:
    return rendering.meshes == "light" and path.name != FINGER


def _name(path: Path, rendering: Rendering) -> str:
    """Of what is kept of a mesh."""
    return f"{path.stem}-{'light' if _is_light(path, rendering) else 'faithful'}"


def _sources() -> bytes:
    """What determines derived meshes; the installed files' contents are known and checked."""
    return (
        source_code("robot_meshes", "triangles", "camera_mesh", "mesh_simplification")
        + camera_mesh.packed_mask()
    )


def _numbered(part: Shared, number: int) -> Arrays:
    return {f"{field}{number}": array for field, array in part._asdict().items()}


def _installed(path: Path) -> list[tuple[Triangles, _Look | None]]:
    """The parts of an installed mesh that can be seen, with their own looks."""
    if path.suffix == ".stl":
        return [(Triangles(*camera_mesh.visible_triangles(path)), None)]
    return [
        (
            Triangles(
                part.vertices[part.triangles], part.get_vertex_normal()[part.triangles[:, 0]]
            ),
            _Look.of(part.material),
        )
        for part in sapien.render.RenderShapeTriangleMesh(str(path)).parts
    ]
