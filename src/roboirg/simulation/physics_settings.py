"""Physics, light and control settings of ManiSkill 3.0.1, so that dynamics and pictures match."""

from __future__ import annotations

import functools
import math
from pathlib import Path

import numpy as np
import sapien
import sapien.physx
import sapien.render

from roboirg.util.media import CONTROL_RATE

PHYSICS_RATE = 100
"""Physics steps per second."""
PHYSICS_STEPS = PHYSICS_RATE // CONTROL_RATE
"""Physics steps in a control step."""
CONTROL_PERIOD = 1.0 / CONTROL_RATE
"""Seconds in a control step."""

HOME = np.array([0.0, 0.0, 0.0, -math.pi / 2, 0.0, math.pi / 2, math.pi / 4])
"""Home joint positions (7), rad, with the hand at the top of the front picture (RoboMME)."""
HOME_ACTION = np.append(HOME, 1.0)
"""Action (8) that keeps the robot at home with an open gripper."""

OPEN = 1.0
CLOSED = -1.0
"""Gripper actions."""
GRIPPER_STEPS = 6
"""Control steps for opening or closing the gripper (RoboMME)."""
FINGER_OPEN = 0.04
FINGER_SQUEEZE = -0.01
"""Finger targets, m, of gripper actions +1 and -1; the joint limit keeps the fingers >= 0."""

STIFFNESS = 1000.0
DAMPING = 100.0
FORCE_LIMIT = 100.0

AMBIENT_LIGHT = (0.3, 0.3, 0.3)
LIGHT_DIRECTIONS = ((1.0, 1.0, -1.0), (0.0, 0.0, -1.0))


@functools.cache
def apply_physics_settings() -> None:
    """Set SAPIEN's defaults for the physics of all scenes; call before building anything."""
    physx = sapien.physx
    physx.set_scene_config(
        gravity=np.array([0, 0, -9.81]),
        bounce_threshold=2.0,
        enable_pcm=True,
        enable_tgs=True,
        enable_ccd=False,
        enable_enhanced_determinism=False,
        enable_friction_every_iteration=True,
        cpu_workers=0,
    )
    physx.set_body_config(
        solver_position_iterations=15, solver_velocity_iterations=1, sleep_threshold=0.005
    )
    physx.set_shape_config(contact_offset=0.02, rest_offset=0.0)
    physx.set_default_material(0.3, 0.3, 0.0)


@functools.cache
def apply_render_settings() -> None:
    """Set the default camera shader and the picture formats."""
    # By its whole path: where there is no home, SAPIEN has not set where it looks for names.
    shader = Path(sapien.__file__).parent / "vulkan_shader" / "minimal"
    sapien.render.set_camera_shader_dir(str(shader))
    sapien.render.set_picture_format("Color", "r8g8b8a8unorm")
    sapien.render.set_picture_format("ColorRaw", "r8g8b8a8unorm")
    sapien.render.set_picture_format("PositionSegmentation", "r16g16b16a16sint")


def add_lights(scene: sapien.Scene) -> None:
    """Add two white directional lights without shadows, and ambient light."""
    scene.set_ambient_light(AMBIENT_LIGHT)
    for direction in LIGHT_DIRECTIONS:
        light = sapien.render.RenderDirectionalLightComponent()
        light.color = [1.0, 1.0, 1.0]
        light.shadow = False
        entity = sapien.Entity()
        entity.name = "directional_light"
        entity.add_component(light)
        along_x = [1.0, 0.0, 0.0]
        turn = sapien.math.shortest_rotation(along_x, direction)
        light.pose = sapien.Pose([0.0, 0.0, 0.0], turn)
        scene.add_entity(entity)
