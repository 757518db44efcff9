"""The front and the wrist camera: pictures, depth and segmentation, drawn on request.

Drawing is most of the cost of a step on a CPU, and most of that goes into bodies outside the
picture. Each body's box is tested against the sides of the camera's view and hidden for this
picture if it is outside; without shadows that cannot change a pixel.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
import sapien
import sapien.render
from numpy.typing import NDArray

SIZE = 256
"""Width and height of a picture, pixels."""
FIELD_OF_VIEW = math.pi / 2
NEAR, FAR = 0.01, 100.0

FRONT_EYE = (0.3, 0.0, 0.4)
FRONT_TARGET = (0.0, 0.0, -0.2)

CULLING_MARGIN = 0.002
"""Metres by which boxes are grown before the test."""


COLOUR, GEOMETRY = "Color", "PositionSegmentation"
"""What the shader writes in one go: RGBA; and x, y, z in mm in the camera's frame (x right, y up,
z backward) with the id of the entity, int16."""


@dataclass
class _Drawn:
    """The poses of everything when a camera last drew, and what has been fetched of it."""

    state: bytes
    fetched: dict[str, NDArray[np.integer[Any]]] = field(default_factory=dict)


class Cameras:
    """The two cameras of a scene.

    While nothing has moved, a picture is not drawn again.

    Args:
        scene: with all its bodies built.
        mount: the link that carries the wrist camera.
    """

    def __init__(self, scene: sapien.Scene, mount: sapien.Entity) -> None:
        self._scene = scene
        fixed = sapien.Entity()
        fixed.name = "front_camera"
        self._components = {"front": _component("front"), "wrist": _component("wrist")}
        fixed.add_component(self._components["front"])
        fixed.set_pose(look_at(FRONT_EYE, FRONT_TARGET))
        scene.add_entity(fixed)
        mount.add_component(self._components["wrist"])
        for component in self._components.values():
            component.set_texture("BRDFLUT", _stand_in_table())
        self._bodies = _bodies(scene)
        self._last: dict[str, _Drawn] = {}
        self._boxes = np.stack([_local_corners(body) for body in self._bodies])

    def picture(self, camera: str) -> NDArray[np.uint8]:
        """What the camera sees now, RGB, shape (256, 256, 3)."""
        rgba = self._look(camera, COLOUR)
        return np.asarray(cv2.cvtColor(rgba, cv2.COLOR_RGBA2RGB), dtype=np.uint8)

    def depth(self, camera: str) -> NDArray[np.int16]:
        """How far in front of the camera things are, mm, shape (256, 256, 1); 0 for nothing."""
        return np.asarray(-self._look(camera, GEOMETRY)[..., 2:3], dtype=np.int16)

    def segmentation(self, camera: str) -> NDArray[np.int16]:
        """Which entity each pixel shows, by ``entity.per_scene_id``, shape (256, 256)."""
        return np.asarray(self._look(camera, GEOMETRY)[..., 3], dtype=np.int16).copy()

    def extrinsic(self, camera: str) -> NDArray[np.float32]:
        """From the world's frame to the camera's, (3, 4): x right, y down, z forward (OpenCV)."""
        matrix = self._components[camera].get_extrinsic_matrix()
        return np.asarray(matrix, dtype=np.float32)[:3].copy()

    def intrinsic(self, camera: str) -> NDArray[np.float32]:
        """From the camera's frame to pixels, (3, 3), OpenCV."""
        return np.array(self._components[camera].get_intrinsic_matrix(), dtype=np.float32)

    def _look(self, camera: str, what: str) -> NDArray[np.integer[Any]]:
        """What the camera's shader writes now; drawn only if something has moved."""
        component = self._components[camera]
        poses = np.stack([body.entity.pose.to_transformation_matrix() for body in self._bodies])
        view = np.asarray(component.get_extrinsic_matrix(), dtype=np.float64)
        state = poses.tobytes() + view.tobytes()
        known = self._last.get(camera)
        if known is None or known.state != state:
            known = _Drawn(state, {what: self._draw(component, self._visible(poses, view), what)})
            self._last[camera] = known
        elif what not in known.fetched:
            # The last drawing is still there.
            known.fetched[what] = np.asarray(component.get_picture(what))
        return known.fetched[what]

    def _draw(
        self,
        component: sapien.render.RenderCameraComponent,
        visible: NDArray[np.bool_],
        what: str,
    ) -> NDArray[np.integer[Any]]:
        """A new picture with the bodies outside the view left out."""
        self._scene.update_render()
        hidden = [body for body, seen in zip(self._bodies, visible, strict=True) if not seen]
        for body in hidden:
            body.visibility = 0.0
        component.take_picture()
        picture = np.asarray(component.get_picture(what))  # waits until it is drawn
        for body in hidden:
            body.visibility = 1.0
        return picture

    def _visible(self, poses: NDArray[np.float64], view: NDArray[np.float64]) -> NDArray[np.bool_]:
        """For each body whether its box reaches into the camera's view."""
        world = np.einsum("bij,bkj->bki", poses, self._boxes)
        # OpenCV axes: x right, y down, z forward; the half view is 45 degrees, so the sides of
        # the view are the planes |x| = z and |y| = z.
        x, y, z = np.moveaxis(world @ view.T, -1, 0)[:3]
        outside = (
            (z < NEAR).all(axis=1)
            | (x > z).all(axis=1)
            | (-x > z).all(axis=1)
            | (y > z).all(axis=1)
            | (-y > z).all(axis=1)
        )
        return np.asarray(~outside)


def look_at(eye: tuple[float, float, float], target: tuple[float, float, float]) -> sapien.Pose:
    """Pose of a camera (x forward, z up, as SAPIEN has it) that looks at a target."""
    forward = np.subtract(target, eye)
    forward /= np.linalg.norm(forward)
    left = np.cross([0.0, 0.0, 1.0], forward)
    left /= np.linalg.norm(left)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([forward, left, np.cross(forward, left)], axis=1)
    matrix[:3, 3] = eye
    return sapien.Pose(matrix)


def _component(name: str) -> sapien.render.RenderCameraComponent:
    component = sapien.render.RenderCameraComponent(SIZE, SIZE)
    component.set_fovy(FIELD_OF_VIEW, compute_x=True)
    component.near, component.far = NEAR, FAR
    component.name = name
    return component


@functools.cache
def _stand_in_table() -> sapien.render.RenderTexture:
    """A tiny texture in the place of a table that the cameras' shader never needs.

    The shader samples the table only for an environment map, which is black here; without a
    stand-in SAPIEN computes it for three seconds before the first picture. It is kept for the
    life of the process, because cameras do not keep their textures alive.
    """
    return sapien.render.RenderTexture(np.zeros((2, 2, 4), np.uint8), 2, "r8g8b8a8unorm")


def _bodies(scene: sapien.Scene) -> list[sapien.render.RenderBodyComponent]:
    return [
        component
        for entity in scene.entities
        for component in entity.components
        if isinstance(component, sapien.render.RenderBodyComponent)
    ]


_boxes_of_files: dict[tuple[object, ...], NDArray[np.float64]] = {}


def _local_corners(body: sapien.render.RenderBodyComponent) -> NDArray[np.float64]:
    """Homogeneous corners (8, 4) of the body's box in its entity's frame, with the margin."""
    corners: list[NDArray[np.float64]] = [_shape_corners(shape) for shape in body.render_shapes]
    points = np.concatenate(corners)
    low, high = points.min(axis=0) - CULLING_MARGIN, points.max(axis=0) + CULLING_MARGIN
    grid = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), axis=-1)
    return np.column_stack([grid.reshape(-1, 3), np.ones(8)])


def _shape_corners(shape: sapien.render.RenderShape) -> NDArray[np.float64]:
    """Corners of a shape's box in its entity's frame, (8, 3)."""
    low, high = _shape_bounds(shape)
    grid = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), axis=-1)
    matrix = shape.local_pose.to_transformation_matrix()
    return np.asarray(grid.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3])


def _shape_bounds(
    shape: sapien.render.RenderShape,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest coordinates in the shape's own frame."""
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
