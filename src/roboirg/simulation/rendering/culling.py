"""View-frustum culling: a camera draws only the bodies that reach into its view.

Bodies are tested by their bounding boxes, the robot's links also by their convex hulls. Without
shadows, culling changes no pixel.

SAPIEN records a camera's command buffer once, and again only if the scene has changed. It leaves
out bodies with an unknown shading mode, and a change of the mode alone does not trigger a new
recording. So each camera keeps the command buffer of its visible bodies until that set changes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
import sapien
import sapien.render
from numpy.typing import NDArray

from roboirg.core.observations import CAMERAS
from roboirg.simulation.rendering.viewpoint import NEAR, transformed

MARGIN = 0.002
"""Meters by which boxes grow before the test."""
HULL_MARGIN = 1e-4
"""Meters by which convex hulls grow; the renderer is 100 times as precise. The hand stays 1 mm
outside the wrist camera's view, so a larger margin would draw it."""

DRAWN = 0
LEFT_OUT = 99
"""Shading modes; SAPIEN does not know the second."""

PLANE = 0
POINT = -1
"""First and last axis of what `_outside` returns; an axis between is of bodies."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class CullableBody:
    """What is known of a body for culling: its convex hull, and which cameras may draw it.

    Attributes:
        hull: vertices (n, 3) of its convex hull in the frame of its entity, m.
        cameras: cameras that draw it if it reaches into their views.
    """

    hull: Floats
    cameras: Collection[str] = CAMERAS


class CullableBodies:
    """All render bodies of a finished scene, numbered; it decides which of them a camera draws.

    Args:
        scene: with all its bodies.
        cullable_bodies: culling data of some; the others are tested by their boxes alone.
    """

    def __init__(
        self,
        scene: sapien.Scene,
        cullable_bodies: Mapping[sapien.render.RenderBodyComponent, CullableBody],
    ) -> None:
        self._bodies = _render_bodies(scene)
        # Hulls by the number of the body, as homogeneous columns (4, k).
        self._hulls: dict[int, Floats] = {}
        # By camera: whether it may draw each body.
        self._drawn_by = {camera: np.ones(len(self._bodies), dtype=bool) for camera in CAMERAS}
        boxes = []
        for number, body in enumerate(self._bodies):
            cullable = cullable_bodies.get(body)
            if cullable is None:
                points = _points(body)
            else:
                points = cullable.hull
                self._hulls[number] = _columns(points)
                for camera in CAMERAS:
                    self._drawn_by[camera][number] = camera in cullable.cameras
            boxes.append(_columns(_corners(points, MARGIN)))
        self._boxes = np.stack(boxes)  # corners of each body's box as columns, (n, 4, 8)
        # Which bodies have the shading mode of drawn ones now, and in each command buffer.
        self._drawn = np.ones(len(self._bodies), dtype=bool)
        self._buffered: dict[sapien.render.RenderCameraComponent, NDArray[np.bool_]] = {}

    def poses(self) -> Floats:
        """Return the current poses of the bodies in the world frame, (n, 4, 4)."""
        return np.stack([body.entity.pose.to_transformation_matrix() for body in self._bodies])

    def visible(self, camera: str, poses: Floats, view: Floats) -> NDArray[np.bool_]:
        """Return for each body whether a camera draws it: (n,).

        Args:
            camera: name of the camera.
            poses: as of `poses`, (n, 4, 4).
            view: extrinsic matrix of the camera (3, 4), from the world to the camera (OpenCV).
        """
        to_camera = view @ poses  # (n, 3, 4), from the frame of each body
        outside = _outside(to_camera @ self._boxes)
        visible = self._drawn_by[camera] & _reach_view(outside)
        # Boxes are larger than what they hold: where one crosses a plane, the hull decides.
        crosses_plane = outside.any(axis=(PLANE, POINT))
        for number in np.flatnonzero(visible & crosses_plane):
            hull = self._hulls.get(number)
            if hull is not None:
                visible[number] = _reach_view(_outside(to_camera[number] @ hull, HULL_MARGIN))
        return visible

    def take_picture(
        self, camera: sapien.render.RenderCameraComponent, visible: NDArray[np.bool_]
    ) -> None:
        """Start drawing these bodies with a camera; the picture is fetched later.

        Args:
            camera: of the scene.
            visible: (n,) as of `visible`; the array is kept, so it must not change.
        """
        # Set the modes even if the command buffer is kept: another change may invalidate it.
        for number in np.flatnonzero(visible != self._drawn):
            self._bodies[number].shading_mode = DRAWN if visible[number] else LEFT_OUT
        self._drawn = visible
        buffered = self._buffered.get(camera)
        if buffered is None or not np.array_equal(buffered, visible):
            invalidate_command_buffers(self._bodies[0])
            self._buffered[camera] = visible
        camera.take_picture()


def _render_bodies(scene: sapien.Scene) -> list[sapien.render.RenderBodyComponent]:
    """Return the components of a scene's entities that are drawn."""
    found: list[sapien.render.RenderBodyComponent] = []
    for entity in scene.entities:
        for component in entity.components:
            if isinstance(component, sapien.render.RenderBodyComponent):
                found.append(component)
    return found


def _outside(points: Floats, margin: float = 0.0) -> NDArray[np.bool_]:
    """Return for each plane that bounds a view which points are outside of it: (5, ..., k).

    The half angle of view is 45 degrees, so the planes are z = NEAR, |x| = z and |y| = z. A point
    that is a margin m outside of |x| = z has |x| = z + √2 m.

    Args:
        points: (..., 3, k), m, one a column, in the camera's frame: x right, y down, z forward
            (OpenCV).
        margin: distance outside, m, that counts.
    """
    x, y, z = np.moveaxis(points, -2, 0)
    edge = z + math.sqrt(2.0) * margin
    return np.stack([z < NEAR - margin, x > edge, -x > edge, y > edge, -y > edge])


def _reach_view(outside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return for each body whether it may be seen: no plane has all its points outside.

    Args:
        outside: (5, ..., k) as of `_outside`; the result is (...).
    """
    return np.asarray(~np.any(np.all(outside, axis=POINT), axis=PLANE))


def invalidate_command_buffers(body: sapien.render.RenderBodyComponent) -> None:
    """Make every camera of a body's scene record a new command buffer before its next picture."""
    body.visibility = 0.0
    body.visibility = 1.0


_corners_of_files: dict[tuple[object, ...], Floats] = {}
"""Corners of the boxes of meshes by file and scale."""


def _columns(points: Floats) -> Floats:
    """Return points (n, 3) as homogeneous columns (4, n), to be multiplied by pose matrices."""
    return np.stack([*points.T, np.ones(len(points))])


def _corners(points: NDArray[np.floating], margin: float = 0.0) -> Floats:
    """Return the corners (8, 3) of the box around points (n, 3), m, grown by a margin, m."""
    low = points.min(axis=0).astype(np.float64) - margin
    high = points.max(axis=0).astype(np.float64) + margin
    return np.array(list(itertools.product(*zip(low, high, strict=True))))


def _points(body: sapien.render.RenderBodyComponent) -> Floats:
    """Return corners (n, 3) of the boxes of a body's shapes in its entity's frame."""
    points = []
    for shape in body.render_shapes:
        matrix = shape.local_pose.to_transformation_matrix()
        points.append(transformed(_shape_corners(shape), matrix))
    return np.concatenate(points)


def _shape_corners(shape: sapien.render.RenderShape) -> Floats:
    """Return corners (8, 3) of a shape's box in the shape's frame; of a file once per process."""
    if isinstance(shape, sapien.render.RenderShapeBox):
        return _corners(np.array([shape.half_size, -shape.half_size]))
    if isinstance(shape, sapien.render.RenderShapeCylinder):
        half = np.array([shape.half_length, shape.radius, shape.radius])
        return _corners(np.array([half, -half]))
    key = (shape.filename, *shape.scale)
    corners = _corners_of_files.get(key)
    if corners is None:
        corners = _corners(np.concatenate([part.vertices for part in shape.parts]) * shape.scale)
        if shape.filename:
            _corners_of_files[key] = corners
    return corners
