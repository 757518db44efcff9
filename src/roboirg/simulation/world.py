"""The world: a scene, a robot, and time. It plays any episode and knows no task."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import sapien
import sapien.physx
from numpy.typing import NDArray

from roboirg.episode import Fact, KeyPose, Motion, Scene
from roboirg.errors import InvalidValueError, UnknownNameError
from roboirg.observations import CAMERAS
from roboirg.simulation import bodies, detection, settings
from roboirg.simulation.cameras import Cameras
from roboirg.simulation.device import render_system
from roboirg.simulation.robot import CAMERA_LINK, Robot
from roboirg.simulation.scenery import add_scenery


class World:
    """One scene in the simulator, from its first moment on.

    Args:
        scene: the objects.
        motions: scripted movements of objects.
        visible: False leaves out all that is only drawn; pictures are then not to be had, and
            no Vulkan device is needed.

    Attributes:
        elapsed: control steps since the beginning.
        facts: all that held at the last evaluation.
    """

    def __init__(
        self, scene: Scene, motions: Sequence[Motion] = (), *, visible: bool = True
    ) -> None:
        settings.apply_physics_settings()
        systems: list[Any] = [sapien.physx.PhysxCpuSystem()]
        if visible:
            systems.append(render_system())
            settings.apply_render_settings()
        self._scene = sapien.Scene(systems)
        self._physics = systems[0]
        self._physics.timestep = 1.0 / settings.PHYSICS_RATE
        self.robot = Robot(self._scene, visible=visible)
        add_scenery(self._scene, visible=visible)
        self.bodies = {
            item.name: bodies.build(self._scene, item, visible=visible) for item in scene.objects
        }
        self._motions = tuple(motions)
        self._cameras: Cameras | None = None
        if visible:
            settings.add_lights(self._scene)
            self._cameras = Cameras(self._scene, self.robot.links[CAMERA_LINK].entity)
        self.elapsed = 0
        self.facts: frozenset[Fact] = self._detect()

    def step(self, action: NDArray[np.floating[Any]]) -> frozenset[Fact]:
        """Execute one action (8) for one control step.

        Args:
            action: seven joint targets (rad) and the gripper, +1 open to -1 closed.

        Returns:
            The facts that hold afterwards.
        """
        self._move_scripted()
        self.robot.set_targets(action)
        for _ in range(settings.PHYSICS_STEPS):
            self._physics.step()
        self.elapsed += 1
        self.facts = self._detect()
        return self.facts

    def picture(self, camera: str) -> NDArray[np.uint8]:
        """What a camera sees now, RGB, shape (256, 256, 3).

        Raises:
            UnknownNameError: there is no such camera.
            InvalidValueError: the world was built without pictures.
        """
        if self._cameras is None:
            raise InvalidValueError("This world was built without pictures (visible=False).")
        if camera not in CAMERAS:
            raise UnknownNameError("camera", camera, CAMERAS)
        return self._cameras.picture(camera)

    def _move_scripted(self) -> None:
        """Hold objects where their motions want them at this step; release them at the end."""
        for motion in self._motions:
            body, key = self.bodies[motion.subject], _key_at(motion, self.elapsed)
            if key is not None and key.position is not None:
                body.put(key.position)
            elif key is not None and key.step == self.elapsed:
                body.put(body.item.position)

    def _detect(self) -> frozenset[Fact]:
        contacts = self._scene.physx_system.get_contacts() if self.elapsed else []
        # Nothing is to be concluded from where a motion held an object in the last step.
        last = max(self.elapsed - 1, 0)
        keys = {motion.subject: _key_at(motion, last) for motion in self._motions}
        held = {name for name, key in keys.items() if key is not None and key.position is not None}
        free = [body for name, body in self.bodies.items() if name not in held]
        return detection.detect(free, self.robot, contacts)


def _key_at(motion: Motion, step: int) -> KeyPose | None:
    """The key of a motion that is in force at a step; None before the first."""
    return next((key for key in reversed(motion.keys) if key.step <= step), None)
