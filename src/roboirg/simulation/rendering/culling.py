"""View-frustum culling: a camera draws only the bodies that reach into its view.

Bodies are tested by their bounding boxes, the robot's links also by their convex hulls. Without
shadows, culling changes no pixel.

SAPIEN records a camera's command buffer once, and again only if the scene has changed. It leaves
out bodies with an unknown shading mode, and a change of the mode alone does not trigger a new
recording. So each camera keeps the command buffer of its visible bodies until that set changes.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
import sapien
import sapien.render
from numpy.typing import NDArray

from roboirg.core.observations import CAMERAS
from roboirg.simulation.rendering.viewpoint import NEAR

MARGIN = 0.002
"""Meters by which boxes grow before the test."""
HULL_MARGIN = 1e-4
"""Meters by which convex hulls grow; the renderer is 100 times as precise. The hand stays 1 mm
outside the wrist camera's view, so a larger margin would draw it."""

DRAWN, LEFT_OUT = 0, 99
"""Shading modes; SAPIEN does not know the second."""


Floats = NDArray[np.float64]


@dataclass(frozen=True)
class CullableBody:
    """Culling data of a body.

    Attributes:
        hull: vertices (n, 3) of its convex hull in the frame of its entity, m.
        cameras: cameras that draw it if it reaches into their views.
    """

    hull: Floats
    cameras: Collection[str] = CAMERAS


class CullableBodies:
    """All render bodies of a finished scene; those without culling data are tested by boxes."""

    def __init__(
        self,
        scene: sapien.Scene,
        cullable_bodies: Mapping[sapien.render.RenderBodyComponent, CullableBody],
    ) -> None:
        self._bodies = [
            component
            for entity in scene.entities
            for component in entity.components
            if isinstance(component, sapien.render.RenderBodyComponent)
        ]
        known = [cullable_bodies.get(body) for body in self._bodies]
        self._hulls = [None if one is None else one.hull for one in known]
        self._boxes = np.stack(
            [
                _box(_points(body) if hull is None else hull)
                for body, hull in zip(self._bodies, self._hulls, strict=True)
            ]
        )
        self._drawn_by = {
            camera: np.array([one is None or camera in one.cameras for one in known])
            for camera in CAMERAS
        }
        self._drawn = np.ones(len(self._bodies), dtype=bool)
        self._buffered: dict[sapien.render.RenderCameraComponent, NDArray[np.bool_]] = {}

    def poses(self) -> Floats:
        """Return the current poses of the bodies, (n, 4, 4)."""
        return np.stack([body.entity.pose.to_transformation_matrix() for body in self._bodies])

    def visible(self, camera: str, poses: Floats, view: Floats) -> NDArray[np.bool_]:
        """Return for each body whether a camera draws it.

        Args:
            camera: name of the camera.
            poses: poses of the bodies, (n, 4, 4).
            view: extrinsic matrix of the camera (3, 4).
        """
        outside = _outside(np.einsum("bij,bkj->bki", poses, self._boxes) @ view.T)
        seen = self._drawn_by[camera] & ~outside.all(axis=-1).any(axis=0)
        for number in np.flatnonzero(seen & outside.any(axis=(0, -1))):
            hull = self._hulls[number]
            if hull is not None:
                to_camera = view @ poses[number]
                points = hull @ to_camera[:, :3].T + to_camera[:, 3]
                seen[number] = not _outside(points, HULL_MARGIN).all(axis=-1).any()
        return np.asarray(seen)

    def take_picture(
        self, camera: sapien.render.RenderCameraComponent, visible: NDArray[np.bool_]
    ) -> None:
        """Start drawing these bodies with a camera; the picture is fetched later."""
        # Set the modes even if the command buffer is kept: another change may invalidate it.
        for number in np.flatnonzero(visible != self._drawn):
            self._bodies[number].shading_mode = DRAWN if visible[number] else LEFT_OUT
        self._drawn = visible
        buffered = self._buffered.get(camera)
        if buffered is None or not np.array_equal(buffered, visible):
            invalidate_command_buffers(self._bodies[0])
            self._buffered[camera] = visible
        camera.take_picture()


def _outside(points: Floats, margin: float = 0.0) -> NDArray[np.bool_]:
    """Return for each plane of a view's frustum, (5, ...), which points are outside.

    The half angle of view is 45 degrees, so the planes are z = NEAR, |x| = z and |y| = z.

    Args:
        points: (..., 3), m, in the camera's frame: x right, y down, z forward (OpenCV).
        margin: distance outside, m, that counts.
    """
    x, y, z = np.moveaxis(points, -1, 0)
    slack = math.sqrt(2.0) * margin
    return np.stack([z < NEAR - margin, *(side > z + slack for side in (x, -x, y, -y))])


def invalidate_command_buffers(body: sapien.render.RenderBodyComponent) -> None:
    """Make every camera of a body's scene record a new command buffer before its next picture."""
    body.visibility = 0.0
    body.visibility = 1.0


_boxes_of_files: dict[tuple[object, ...], Floats] = {}


def _box(points: Floats) -> Floats:
    """Return homogeneous corners (8, 4) of the box around points (n, 3), with the margin."""
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    return np.column_stack([_corners(low, high), np.ones(8)])


def _corners(low: Floats, high: Floats) -> Floats:
    grid = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), axis=-1)
    return grid.reshape(-1, 3)


def _points(body: sapien.render.RenderBodyComponent) -> Floats:
    """Return corners (n, 3) of the boxes of a body's shapes in its entity's frame."""
    return np.concatenate([_shape_corners(shape) for shape in body.render_shapes])


def _shape_corners(shape: sapien.render.RenderShape) -> Floats:
    """Return corners of a shape's box in its entity's frame, (8, 3)."""
    corners = _corners(*_shape_bounds(shape))
    matrix = shape.local_pose.to_transformation_matrix()
    return np.asarray(corners @ matrix[:3, :3].T + matrix[:3, 3])


def _shape_bounds(
    shape: sapien.render.RenderShape,
) -> tuple[Floats, Floats]:
    """Return lowest and highest coordinates in the shape's own frame."""
    if isinstance(shape, sapien.render.RenderShapeBox):
        half = np.asarray(shape.half_size, dtype=np.float64)
        return -half, half
    if isinstance(shape, sapien.render.RenderShapeCylinder):
        half = np.array([shape.half_length, shape.radius, shape.radius], dtype=np.float64)
        return -half, half
    key = (shape.filename, *shape.scale)
    bounds = _boxes_of_files.get(key) if shape.filename else None
    if bounds is None:
        points = np.concatenate([part.vertices for part in shape.parts]) * shape.scale
        bounds = np.stack([points.min(axis=0), points.max(axis=0)]).astype(np.float64)
        if shape.filename:
            _boxes_of_files[key] = bounds
    return bounds[0], bounds[1]
