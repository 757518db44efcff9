"""The front and the wrist camera: pictures, depth and segmentation, drawn on request.

Drawing is most of the cost of a step on a CPU, so only what a camera can see is drawn
(`roboirg.simulation.culling`), and nothing twice.
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

from roboirg.observations import CAMERAS
from roboirg.simulation.culling import Bodies
from roboirg.simulation.rendering import FAITHFUL, Rendering
from roboirg.simulation.robot import CAMERA_LINK, Robot
from roboirg.simulation.shaders import COLOUR, STOCK_COLOUR, slim_shader, stand_in_table
from roboirg.simulation.viewpoint import (
    FAR,
    FIELD_OF_VIEW,
    FRONT_EYE,
    FRONT_TARGET,
    NEAR,
    SIZE,
    look_at,
)

GEOMETRY = "PositionSegmentation"
"""What the shaders write besides the colours: x, y, z in mm in the camera's frame (x right, y up,
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
        robot: carries the wrist camera.
        rendering: how pictures are made.
    """

    def __init__(self, scene: sapien.Scene, robot: Robot, rendering: Rendering = FAITHFUL) -> None:
        self._scene = scene
        shader = slim_shader() if rendering.slim_shader else None
        fixed = sapien.Entity()
        fixed.name = "front_camera"
        self._colour = STOCK_COLOUR if shader is None else COLOUR
        self._components = {name: _component(name, shader or "") for name in CAMERAS}
        fixed.add_component(self._components["front"])
        fixed.set_pose(look_at(FRONT_EYE, FRONT_TARGET))
        scene.add_entity(fixed)
        robot.links[CAMERA_LINK].entity.add_component(self._components["wrist"])
        for component in self._components.values() if rendering.quick_start else ():
            component.set_texture("BRDFLUT", stand_in_table())
        self._bodies = Bodies(scene, robot.skins)
        self._culling = rendering.culling
        self._last: dict[str, _Drawn] = {}
        self._looks_back = False

    def picture(self, camera: str) -> NDArray[np.uint8]:
        """What the camera sees now, RGB, shape (256, 256, 3)."""
        return self.pictures((camera,))[camera]

    def pictures(self, cameras: Sequence[str]) -> dict[str, NDArray[np.uint8]]:
        """What several cameras see now; quicker than one after the other."""
        self.draw(cameras)
        return {
            camera: np.asarray(cv2.cvtColor(self._fetch(camera, self._colour), cv2.COLOR_RGBA2RGB))
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
        """Have cameras begin to draw what they see now, as far as something has moved.

        It is drawn in the background. What is read later is of now if nothing has moved by then,
        or within `looking_back`.
        """
        if self._looks_back:
            return
        poses = self._bodies.poses()
        due = []
        for camera in cameras:
            view = np.asarray(self._components[camera].get_extrinsic_matrix(), dtype=np.float64)
            state = poses.tobytes() + view.tobytes()
            known = self._last.get(camera)
            if known is None or known.state != state:
                self._last[camera] = _Drawn(state)
                due.append((camera, view))
        if due:
            self._scene.update_render()
        for camera, view in due:
            self._draw(camera, poses, view)

    @contextmanager
    def looking_back(self) -> Iterator[None]:
        """Within it, what is read is what was last drawn, whatever has moved since."""
        self._looks_back = True
        try:
            yield
        finally:
            self._looks_back = False

    def _draw(self, camera: str, poses: NDArray[np.float64], view: NDArray[np.float64]) -> None:
        component = self._components[camera]
        if self._culling:
            self._bodies.take(component, self._bodies.visible(camera, poses, view))
        else:
            component.take_picture()

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
