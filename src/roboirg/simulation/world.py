"""The simulated world: a scene, a robot, and time. It is independent of tasks."""

from __future__ import annotations

import os
from collections.abc import Set as AbstractSet

import sapien
import sapien.physx

from roboirg.core.actions import Actions
from roboirg.core.conditions import Fact
from roboirg.core.episode import Scene
from roboirg.core.errors import InvalidValueError, RoboIRGError, check_names
from roboirg.core.observations import CAMERAS, Pixels
from roboirg.core.waiting import PHYSICS
from roboirg.simulation import bodies, physics_settings
from roboirg.simulation.cameras import Cameras
from roboirg.simulation.fact_detection import FactDetector
from roboirg.simulation.motion_player import MotionContext, MotionPlayer
from roboirg.simulation.panda import Panda
from roboirg.simulation.rendering.render_device import render_system
from roboirg.simulation.rendering.render_settings import FAITHFUL, RenderSettings
from roboirg.simulation.scenery import add_scenery


class World:
    """One scene in the simulator, from its start.

    Args:
        scene: the objects and their scripted movements.
        visible: False leaves out everything that is only drawn; there are then no pictures, and
            no Vulkan device is needed.
        rendering: how pictures are drawn.

    Attributes:
        robot: the robot.
        bodies: the objects, by name.
        elapsed: control steps since the start.
        facts: all facts that hold now, such as *picked, cube 1* (`roboirg.core.fact_traits`).
    """

    def __init__(
        self, scene: Scene, *, visible: bool = True, rendering: RenderSettings = FAITHFUL
    ) -> None:
        physics_settings.apply_physics_settings()
        self._physics = sapien.physx.PhysxCpuSystem()
        systems: list[sapien.System] = [self._physics]
        if visible:
            check_drawing_process()
            systems.append(render_system(keep_engine=rendering.quick_start))
            physics_settings.apply_render_settings()
        self._scene = sapien.Scene(systems)
        self._physics.timestep = 1.0 / physics_settings.PHYSICS_RATE
        self.robot = Panda(self._scene, visible=visible, rendering=rendering)
        add_scenery(self._scene, visible=visible, rendering=rendering)
        self.bodies: dict[str, bodies.Body] = {}
        for item in scene.objects:
            self.bodies[item.name] = bodies.build(self._scene, item, visible=visible)

        self._motions = MotionPlayer(scene.motions, self.bodies)
        self._detector = FactDetector(self.bodies, self.robot)
        self._stage_starts: dict[int, int] = {}
        self._cameras: Cameras | None = None
        if visible:
            physics_settings.add_lights(self._scene)
            self._cameras = Cameras(self._scene, self.robot, rendering)
        self.elapsed = 0
        self.facts: frozenset[Fact] = self._detector.detect([], self._motions.absent())

    def step(self, action: Actions) -> frozenset[Fact]:
        """Execute one action (8) for one control step.

        Args:
            action: seven joint targets (rad) and the gripper, +1 open to -1 closed.

        Returns:
            The facts that hold afterwards.
        """
        context = MotionContext(self.elapsed, self.facts, self._stage_starts)
        self._motions.before_step(context)
        self.advance(action)
        self.elapsed += 1
        contacts = self._physics.get_contacts()
        self.facts = self._detector.detect(contacts, self.absent, self._motions.stopped())
        self._motions.after_step(self.facts)
        return self.facts

    def advance(self, action: Actions) -> None:
        """Run only the physics of one control step: no motions, no facts, no time."""
        with PHYSICS:
            self.robot.set_targets(action)
            for _ in range(physics_settings.PHYSICS_STEPS):
                self._physics.step()

    @property
    def attempts(self) -> AbstractSet[Fact]:
        """What the hand tried in the last step: facts that no stage expects."""
        return self._detector.attempts.found

    @property
    def absent(self) -> frozenset[str]:
        """Names of the objects that are out of the world; their positions mean nothing."""
        return self._motions.absent()

    def note_stage(self, index: int) -> None:
        """Record the step at which a stage became due, for the motions that wait for it.

        Call it in every step with the index of the stage that is due; only the first call counts.
        """
        self._stage_starts.setdefault(index, self.elapsed)

    def picture(self, camera: str) -> Pixels:
        """Return the current picture of a camera, RGB, shape (256, 256, 3)."""
        check_names("camera", [camera], CAMERAS)
        return self.cameras.picture(camera)

    @property
    def cameras(self) -> Cameras:
        """The cameras of this world."""
        if self._cameras is None:
            raise InvalidValueError("This world was built without pictures (visible=False).")
        return self._cameras


_drawing_processes: set[int] = set()
"""The id of this process, if it has drawn; a forked process inherits that of its parent."""


def check_drawing_process() -> None:
    """Remember that this process draws, and refuse if one from which it was forked had drawn."""
    other_processes = _drawing_processes - {os.getpid()}
    if other_processes:
        raise RoboIRGError(
            "This process was forked from one that had drawn pictures, and the renderer's "
            "threads do not survive a fork; start it another way, such as AsyncVectorEnv(..., "
            "context='spawn')."
        )
    _drawing_processes.add(os.getpid())
