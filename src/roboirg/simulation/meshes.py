"""The robot's meshes in a form that is quick to draw, derived from the installed files.

The installed meshes are shaded flat, with three corners of its own for each triangle, and computing
corners is most of what drawing them costs on a processor. Where a triangle's normal is that of its
first corner (`roboirg.simulation.shaders`), the other two can be any corners at their places.
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

from roboirg.simulation import camera_mesh, shaders
from roboirg.simulation.derived import Arrays, code_of, kept_arrays
from roboirg.simulation.light_meshes import CAMERA_SHARE, LINK_SHARE, SMALL, lighten
from roboirg.simulation.occlusion import shown_triangles
from roboirg.simulation.rendering import Rendering
from roboirg.simulation.viewpoint import to_front_camera

FINGER = "finger.glb"
"""Seen from so near by the wrist camera that it is never lightened."""


class Triangles(NamedTuple):
    """Triangles that are shaded flat.

    Attributes:
        corners: (n, 3, 3), metres.
        normals: (n, 3).
    """

    corners: NDArray[np.float32]
    normals: NDArray[np.float32]


class Shared(NamedTuple):
    """Triangles that share corners; the normal of each is that of its first corner.

    Attributes:
        vertices: (m, 3), metres.
        normals: (m, 3).
        triangles: (n, 3), indices of vertices.
    """

    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    triangles: NDArray[np.uint32]


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
    place = None if seen_at is None else _Place(tuple(seen_at.p), tuple(seen_at.q))
    return [shape.clone() for shape in _shapes(path, look, rendering, place)]


@functools.cache
def link_hull(path: Path, rendering: Rendering) -> NDArray[np.float64]:
    """Vertices (n, 3) of a link's convex hull, metres in the mesh's frame."""
    return np.asarray(_derived(path, rendering)["hull"], np.float64)


def finish(body: sapien.render.RenderBodyComponent, rendering: Rendering) -> None:
    """Have a body of `link_shapes` that is in a scene shaded as they want it."""
    if _flat(rendering):
        shaders.mark(body)


def share_corners(flat: Triangles) -> Shared:
    """Few vertices for all triangles, in the triangles' order."""
    places = _numbers_of(flat.corners.reshape(-1, 3)).reshape(-1, 3).tolist()
    ways = _numbers_of(flat.normals).tolist()
    at: dict[int, list[int]] = {}
    vertex_of: dict[tuple[int, int], int] = {}
    sources: list[tuple[int, int]] = []
    firsts = []
    for number, (three, way) in enumerate(zip(places, ways, strict=True)):
        # A vertex with this normal, or one more where there are the fewest.
        first = min(
            range(3),
            key=lambda k: -1 if (three[k], way) in vertex_of else len(at.get(three[k], ())),
        )
        if (three[first], way) not in vertex_of:
            vertex_of[three[first], way] = len(sources)
            at.setdefault(three[first], []).append(len(sources))
            sources.append((number, first))
        firsts.append(first)
    for number, three in enumerate(places):
        for corner, place in enumerate(three):
            if place not in at:
                at[place] = [len(sources)]
                sources.append((number, corner))
    triangles = []
    for three, way, first in zip(places, ways, firsts, strict=True):
        here = vertex_of[three[first], way]
        # What has been computed lately need not be computed again.
        others = [
            min(at[three[(first + k) % 3]], key=lambda vertex: abs(vertex - here)) for k in (1, 2)
        ]
        triangles.append([here, *others])
    owners, corners = np.array(sources, dtype=np.intp).reshape(-1, 2).T
    return Shared(
        flat.corners[owners, corners],
        flat.normals[owners],
        np.array(triangles, dtype=np.uint32).reshape(-1, 3),
    )


def _numbers_of(rows: NDArray[np.float32]) -> NDArray[np.intp]:
    """A number for each row, equal for equal rows."""
    return np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)


def _flat(rendering: Rendering) -> bool:
    return rendering.slim_shader and shaders.slim_shader() is not None


@functools.cache
def _shapes(
    path: Path, look: _Look | None, rendering: Rendering, place: _Place | None
) -> Sequence[sapien.render.RenderShapeTriangleMesh]:
    arrays = _derived(path, rendering)
    parts = _parts(arrays)
    if place is not None:
        parts = _seen(parts, place)
    shapes = []
    for number, part in enumerate(parts):
        if not len(part.triangles):
            continue
        numbers = arrays[f"look{number}"]
        vertices, normals, triangles = part if _flat(rendering) else _unshared(part)
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


def _unshared(part: Shared) -> Shared:
    """Three vertices of its own for each triangle."""
    corners, normals = _flattened(part)
    count = 3 * len(corners)
    return Shared(
        corners.reshape(-1, 3),
        np.repeat(normals, 3, axis=0),
        np.arange(count, dtype=np.uint32).reshape(-1, 3),
    )


def _seen(parts: Sequence[Shared], place: _Place) -> list[Shared]:
    """What the front camera can see of parts of an opaque mesh that is in one place for ever."""
    to_camera = to_front_camera(sapien.Pose(place.position, place.quaternion))
    flat = [_flattened(part) for part in parts]
    corners = np.concatenate([part.corners for part in flat])
    shown = shown_triangles(corners @ to_camera[:3, :3].T + to_camera[:3, 3])
    ends = np.cumsum([len(part.corners) for part in flat])[:-1]
    return [
        share_corners(Triangles(part.corners[mask], part.normals[mask]))
        for part, mask in zip(flat, np.split(shown, ends), strict=True)
    ]


def _flattened(part: Shared) -> Triangles:
    return Triangles(part.vertices[part.triangles], part.normals[part.triangles[:, 0]])


def _parts(arrays: Arrays) -> list[Shared]:
    """The triangles in what `_derived` gives, of each part of the mesh."""
    count = sum(name.startswith("triangles") for name in arrays)
    return [
        Shared._make(arrays[f"{field}{part}"] for field in Shared._fields) for part in range(count)
    ]


def _derived(path: Path, rendering: Rendering) -> Arrays:
    """For each part of a mesh the fields of `Shared` and the look, each with the part's number.

    Besides them the convex hull of all parts together.
    """
    light = rendering.meshes == "light" and path.name != FINGER
    # The contents of the installed files are known: they have been checked.
    sources = code_of("meshes", "camera_mesh", "light_meshes") + camera_mesh.packed_mask()

    def derive() -> Arrays:
        arrays: Arrays = {}
        for part, (flat, look) in enumerate(_installed(path)):
            share = CAMERA_SHARE if path.suffix == ".stl" else LINK_SHARE
            lighter = light and len(flat.corners) > SMALL
            drawn = Triangles(*lighten(flat.corners, share=share)) if lighter else flat
            shared = share_corners(drawn)
            for field, array in zip(Shared._fields, shared, strict=True):
                arrays[f"{field}{part}"] = array
            arrays[f"look{part}"] = np.zeros(0) if look is None else look.packed()
        points = np.concatenate([part.vertices for part in _parts(arrays)])
        # SciPy takes a quarter of a second to import, and this is needed once.
        from scipy.spatial import ConvexHull

        arrays["hull"] = points[ConvexHull(points).vertices]
        return arrays

    return kept_arrays(f"{path.stem}-{'light' if light else 'faithful'}", sources, derive)


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
