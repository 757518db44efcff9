"""The front and the wrist camera: pictures, depth and segmentation, drawn on request.

Drawing is most of the cost of a step on a CPU, so only what a camera can see is drawn
(`roboirg.simulation.rendering.culling`), and nothing twice.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
import sapien
import sapien.render
from numpy.typing import NDArray

from roboirg.core.observations import CAMERAS, FRONT, WRIST
from roboirg.simulation.panda import CAMERA_LINK, Panda
from roboirg.simulation.rendering.culling import CullableBodies
from roboirg.simulation.rendering.render_mode import FAITHFUL, Rendering
from roboirg.simulation.rendering.shaders import COLOR, STOCK_COLOR, slim_shader, stand_in_table
from roboirg.simulation.rendering.viewpoint import (
    FAR,
    FIELD_OF_VIEW,
    FRONT_EYE,
    FRONT_TARGET,
    NEAR,
    SIZE,
    look_at,
)

GEOMETRY = "PositionSegmentation"
"""What the shaders write besides the colors: x, y, z in mm in the camera's frame (x right, y up,
z backward) with the id of the entity, int16."""


@dataclass
class _Drawn:
    """What a camera draws.

    Attributes:
        state: all that determines the picture.
        bodies: for each of the scene's whether it is drawn.
        fetched: what has been fetched of what the shader wrote.
    """

    state: bytes
    bodies: NDArray[np.bool_]
    fetched: dict[str, NDArray[np.integer[Any]]] = field(default_factory=dict)


class Cameras:
    """The two cameras of a scene.

    A camera's picture is not drawn again while nothing in its view has moved.

    Args:
        scene: with all its bodies built.
        robot: carries the wrist camera.
        rendering: how pictures are made.
    """

    def __init__(self, scene: sapien.Scene, robot: Panda, rendering: Rendering = FAITHFUL) -> None:
        self._scene = scene
        shader = slim_shader() if rendering.slim_shader else None
        fixed = sapien.Entity()
        fixed.name = "front_camera"
        self._color = STOCK_COLOR if shader is None else COLOR
        self._components = {name: _component(name, shader or "") for name in CAMERAS}
        fixed.add_component(self._components[FRONT])
        fixed.set_pose(look_at(FRONT_EYE, FRONT_TARGET))
        scene.add_entity(fixed)
        robot.links[CAMERA_LINK].entity.add_component(self._components[WRIST])
        for component in self._components.values() if rendering.quick_start else ():
            component.set_texture("BRDFLUT", stand_in_table())
        self._bodies = CullableBodies(scene, robot.drawables)
        self._culling = rendering.culling
        self._last: dict[str, _Drawn] = {}
        # The poses of everything, the wrist camera too, when a camera's last picture was right.
        self._moments: dict[str, bytes] = {}
        self._looks_back = False

    def picture(self, camera: str) -> NDArray[np.uint8]:
        """What the camera sees now, RGB, shape (256, 256, 3)."""
        return self.pictures((camera,))[camera]

    def pictures(self, cameras: Sequence[str]) -> dict[str, NDArray[np.uint8]]:
        """What several cameras see now; quicker than one after the other."""
        self.draw(cameras)
        return {
            camera: np.asarray(cv2.cvtColor(self._fetch(camera, self._color), cv2.COLOR_RGBA2RGB))
            for camera in cameras
        }

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

    def draw(self, cameras: Sequence[str]) -> None:
        """Have cameras begin to draw what they see now, as far as something in view has moved.

        It is drawn in the background. What is read later is of now if nothing has moved by then,
        or within `looking_back`.
        """
        if self._looks_back:
            return
        poses = self._bodies.poses()
        moment = poses.tobytes()
        unsure = [camera for camera in cameras if self._moments.get(camera) != moment]
        now = {camera: self._seen_by(camera, poses) for camera in unsure}
        due = [camera for camera in unsure if self._is_new(camera, now[camera])]
        if due:
            self._scene.update_render()
        for camera in due:
            if self._culling:
                self._bodies.take(self._components[camera], now[camera].bodies)
            else:
                self._components[camera].take_picture()
            self._last[camera] = now[camera]
        self._moments.update(dict.fromkeys(unsure, moment))

    def _seen_by(self, camera: str, poses: NDArray[np.float64]) -> _Drawn:
        """What a camera would draw now."""
        component = self._components[camera]
        view = np.asarray(component.get_extrinsic_matrix(), dtype=np.float64)[:3]
        bodies = np.ones(len(poses), dtype=bool)
        if self._culling:
            bodies = self._bodies.visible(camera, poses, view)
        eye = component.entity.pose
        state = b"".join(it.tobytes() for it in (eye.p, eye.q, bodies, poses[bodies]))
        return _Drawn(state, bodies)

    def _is_new(self, camera: str, drawn: _Drawn) -> bool:
        last = self._last.get(camera)
        return last is None or last.state != drawn.state

    @contextmanager
    def looking_back(self) -> Iterator[None]:
        """Within it, what is read is what was last drawn, whatever has moved since."""
        self._looks_back = True
        try:
            yield
        finally:
            self._looks_back = False

    def _look(self, camera: str, what: str) -> NDArray[np.integer[Any]]:
        self.draw((camera,))
        return self._fetch(camera, what)

    def _fetch(self, camera: str, what: str) -> NDArray[np.integer[Any]]:
        """What the camera's shader wrote last."""
        fetched = self._last[camera].fetched
        if what not in fetched:
            fetched[what] = np.asarray(self._components[camera].get_picture(what))
        return fetched[what]


def _component(name: str, shader: str) -> sapien.render.RenderCameraComponent:
    component = sapien.render.RenderCameraComponent(SIZE, SIZE, shader)
    component.set_fovy(FIELD_OF_VIEW, compute_x=True)
    component.near, component.far = NEAR, FAR
    component.name = name
    return component
