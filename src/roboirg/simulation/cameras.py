"""The front and the wrist camera: pictures, depth and segmentation, drawn on request.

Drawing is most of the cost of a step on a CPU, so a camera draws only what it can see
(`roboirg.simulation.rendering.culling`), and never draws the same picture twice.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
import sapien
import sapien.render
from numpy.typing import NDArray

from roboirg.core.observations import CAMERAS, FRONT, PICTURE_SIZE, WRIST, Pixels
from roboirg.core.waiting import DRAWING
from roboirg.simulation.panda import CAMERA_LINK, Panda
from roboirg.simulation.rendering.culling import CullableBodies
from roboirg.simulation.rendering.render_settings import FAITHFUL, RenderSettings
from roboirg.simulation.rendering.shaders import (
    COLOR,
    STOCK_COLOR,
    placeholder_brdf_table,
    slim_shader,
)
from roboirg.simulation.rendering.viewpoint import (
    FAR,
    FIELD_OF_VIEW,
    NEAR,
    front_camera_pose,
)

GEOMETRY = "PositionSegmentation"
"""The shaders' second output, int16: x, y, z in mm in the camera's frame (x right, y up, z
backward) and the entity id."""


@dataclass
class _View:
    """What a camera has drawn, or is about to: its inputs and fetched outputs.

    Attributes:
        state: everything that determines the picture; equal states give equal pictures.
        bodies: (n,) for each body of the scene, whether it is drawn.
        poses: of all bodies, and so of the wrist camera, when they last gave this view.
        fetched: shader outputs that have been fetched, by name.
    """

    state: bytes
    bodies: NDArray[np.bool_]
    poses: bytes
    fetched: dict[str, NDArray[np.integer[Any]]] = field(default_factory=dict)


class Cameras:
    """The two cameras of a scene whose bodies are all built.

    A camera draws again only if something in its view has moved.
    """

    def __init__(
        self, scene: sapien.Scene, robot: Panda, rendering: RenderSettings = FAITHFUL
    ) -> None:
        self._scene = scene
        self._color = COLOR if rendering.slim_shader else STOCK_COLOR
        self._components = _add_cameras(scene, robot, rendering)
        self._bodies = CullableBodies(scene, robot.cullable_bodies)
        self._has_culling = rendering.culling
        self._last: dict[str, _View] = {}  # by camera: what it has drawn last
        self._is_frozen = False

    def picture(self, camera: str) -> Pixels:
        """Return the current picture, RGB, shape (256, 256, 3)."""
        return self.pictures((camera,))[camera]

    def pictures(self, cameras: Sequence[str]) -> dict[str, Pixels]:
        """Return the current pictures of several cameras; faster than one at a time."""
        self.draw(cameras)
        pictures: dict[str, Pixels] = {}
        for camera in cameras:
            rgba = self._fetch(camera, self._color)
            pictures[camera] = np.asarray(cv2.cvtColor(rgba, cv2.COLOR_RGBA2RGB))
        return pictures

    def depth(self, camera: str) -> NDArray[np.int16]:
        """Return the depth in mm, shape (256, 256, 1); 0 where nothing is visible."""
        z = self._geometry(camera)[..., 2:3]
        return np.asarray(-z, dtype=np.int16)

    def segmentation(self, camera: str) -> NDArray[np.int16]:
        """Return the ``entity.per_scene_id`` at each pixel, shape (256, 256)."""
        entity_ids = self._geometry(camera)[..., 3]
        return np.asarray(entity_ids, dtype=np.int16).copy()

    def extrinsic(self, camera: str) -> NDArray[np.float32]:
        """Return the world-to-camera matrix (3, 4): x right, y down, z forward (OpenCV)."""
        matrix = self._components[camera].get_extrinsic_matrix()
        return np.asarray(matrix, dtype=np.float32)[:3].copy()

    def intrinsic(self, camera: str) -> NDArray[np.float32]:
        """Return the camera-to-pixels matrix (3, 3), OpenCV."""
        return np.array(self._components[camera].get_intrinsic_matrix(), dtype=np.float32)

    def draw(self, cameras: Sequence[str]) -> None:
        """Start drawing the current view of cameras in which something has moved.

        Drawing runs in the background. A later read returns these pictures if nothing has moved
        since, or within `frozen`.
        """
        if self._is_frozen:
            return
        poses = self._bodies.poses()
        poses_bytes = poses.tobytes()
        changed = {}
        for camera in cameras:
            last = self._last.get(camera)
            if last is not None and last.poses == poses_bytes:
                continue
            view = self._view_of(camera, poses)
            if last is not None and last.state == view.state:
                last.poses = poses_bytes
            else:
                changed[camera] = view
        if changed:
            self._take_pictures(changed)

    def _take_pictures(self, views: Mapping[str, _View]) -> None:
        """Start drawing views, by camera, and keep them as the last ones."""
        with DRAWING:
            self._scene.update_render()
            for camera, view in views.items():
                component = self._components[camera]
                if self._has_culling:
                    self._bodies.take_picture(component, view.bodies)
                else:
                    component.take_picture()
                self._last[camera] = view

    def _view_of(self, camera: str, poses: NDArray[np.float64]) -> _View:
        """Return what a camera would draw now, given the poses of all bodies (n, 4, 4)."""
        component = self._components[camera]
        if self._has_culling:
            extrinsic = np.asarray(component.get_extrinsic_matrix(), dtype=np.float64)[:3]
            bodies = self._bodies.visible(camera, poses, extrinsic)
        else:
            bodies = np.ones(len(poses), dtype=bool)
        eye = component.entity.pose
        eye_bytes = eye.p.tobytes() + eye.q.tobytes()
        state = eye_bytes + bodies.tobytes() + poses[bodies].tobytes()
        return _View(state, bodies, poses.tobytes())

    @contextmanager
    def frozen(self) -> Iterator[None]:
        """Context in which reads return the last drawn pictures, even if bodies have moved."""
        self._is_frozen = True
        try:
            yield
        finally:
            self._is_frozen = False

    def _geometry(self, camera: str) -> NDArray[np.integer[Any]]:
        """Return `GEOMETRY` of the current view, (256, 256, 4)."""
        self.draw((camera,))
        return self._fetch(camera, GEOMETRY)

    def _fetch(self, camera: str, output: str) -> NDArray[np.integer[Any]]:
        """Return an output of the camera's last drawing, (256, 256, channels); waits for it."""
        fetched = self._last[camera].fetched
        if output not in fetched:
            with DRAWING:
                fetched[output] = np.asarray(self._components[camera].get_picture(output))
        return fetched[output]


def _add_cameras(
    scene: sapien.Scene, robot: Panda, rendering: RenderSettings
) -> dict[str, sapien.render.RenderCameraComponent]:
    """Add the front camera to a scene and the wrist camera to the robot; return them by name."""
    shader = slim_shader() if rendering.slim_shader else ""  # SAPIEN's own
    cameras = {name: _make_camera(name, shader) for name in CAMERAS}
    fixed = sapien.Entity()
    fixed.name = "front_camera"
    fixed.add_component(cameras[FRONT])
    fixed.set_pose(front_camera_pose())
    scene.add_entity(fixed)
    robot.links[CAMERA_LINK].entity.add_component(cameras[WRIST])
    if rendering.quick_start:
        for component in cameras.values():
            component.set_texture("BRDFLUT", placeholder_brdf_table())
    return cameras


def _make_camera(name: str, shader: str) -> sapien.render.RenderCameraComponent:
    """Return a camera that is in no scene yet.

    Args:
        name: of the camera.
        shader: folder of its shader; empty for SAPIEN's own.
    """
    component = sapien.render.RenderCameraComponent(PICTURE_SIZE, PICTURE_SIZE, shader)
    component.set_fovy(FIELD_OF_VIEW, compute_x=True)
    component.near = NEAR
    component.far = FAR
    component.name = name
    return component
