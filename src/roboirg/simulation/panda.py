"""The Franka Panda with a wrist camera: loading, control, and sensing."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import sapien
import sapien.physx
import sapien.render
from numpy.typing import NDArray
from sapien.wrapper.urdf_loader import URDFLoader

from roboirg.core.actions import ARM_JOINTS, Actions
from roboirg.core.episode import ROBOT_BASE
from roboirg.core.observations import CAMERAS, FRONT, WRIST
from roboirg.simulation import physics_settings
from roboirg.simulation.model_files import ROBOT_FILE, find_model_files
from roboirg.simulation.rendering.culling import CullableBody
from roboirg.simulation.rendering.render_settings import FAITHFUL, RenderSettings
from roboirg.simulation.rendering.robot_meshes import apply_shading, link_hull, link_shapes
from roboirg.simulation.rendering.viewpoint import transformed

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

JointTrajectory = NDArray[np.float64]
"""Actions (n, 8), n >= 1: joint targets (rad) and the gripper."""

FINGERS = ("panda_leftfinger", "panda_rightfinger")
OPENING_SIGNS = (1.0, -1.0)
"""Signs of the fingers' opening directions along their y axes."""
TOOL_LINK = "panda_hand_tcp"
CAMERA_LINK = "camera_link"
BASE_LINK = "panda_link0"

FINGER_FRICTION = 2.0
FINGER_PATCH = 0.1
"""Radius of the patch of a finger that touches an object, m (ManiSkill)."""
GRASP_FORCE = 0.5
"""Newtons on each finger at which an object counts as grasped (ManiSkill)."""
GRASP_ANGLE = math.radians(85.0)
"""Largest angle between a finger's force and its opening direction."""
STILL_SPEED = 0.2
"""Joint speed, rad/s, up to which the robot counts as still."""


class Panda:
    """A Panda in a scene, fixed at its base, at home with an open gripper.

    Args:
        scene: the scene, still empty: the robot must be built first.
        visible: whether to load meshes for drawing.
        rendering: how pictures are drawn.

    Attributes:
        cullable_bodies: culling data of the bodies that cameras draw.
    """

    def __init__(
        self, scene: sapien.Scene, *, visible: bool, rendering: RenderSettings = FAITHFUL
    ) -> None:
        loader = _loader(visible, rendering.meshes == "stock")
        builder = loader.builder
        builder.set_scene(scene)
        builder.initial_pose = sapien.Pose(ROBOT_BASE)
        self.articulation = builder.build()
        self._joints = list(self.articulation.active_joints)
        for joint in self._joints:
            joint.set_drive_properties(
                physics_settings.STIFFNESS,
                physics_settings.DAMPING,
                physics_settings.FORCE_LIMIT,
                mode="force",
            )
            joint.set_friction(0.0)
        self.links = {link.name: link for link in self.articulation.links}
        for link in self.links.values():
            link.disable_gravity = True
        self.tool = self.links[TOOL_LINK]
        self._fingers = [self.links[name] for name in FINGERS]
        self.cullable_bodies: dict[sapien.render.RenderBodyComponent, CullableBody] = {}
        for name, records in loader.visuals.items():
            self._add_meshes(name, records, rendering)
        self.reset()

    def _add_meshes(self, link: str, records: Sequence[Any], rendering: RenderSettings) -> None:
        """Add what is drawn of a link: one render body, or for the base one for each camera.

        Args:
            link: name of the link.
            records: SAPIEN's visual records of the link's meshes: file, material and pose of each.
            rendering: how pictures are drawn.
        """
        hull = _hull(records, rendering)
        bodies: dict[tuple[str, ...], sapien.render.RenderBodyComponent] = {}  # by cameras
        cameras: tuple[str, ...] = CAMERAS
        if link == BASE_LINK and rendering.culling:
            # The base never moves; of it the front camera draws only what reaches a pixel.
            cameras = (FRONT,)
            bodies[cameras] = _render_body(records, rendering, fixed_at=sapien.Pose(ROBOT_BASE))
            cameras = (WRIST,)
        bodies[cameras] = _render_body(records, rendering)
        for drawn_by, body in bodies.items():
            self.links[link].entity.add_component(body)
            apply_shading(body, rendering)
            self.cullable_bodies[body] = CullableBody(hull, drawn_by)

    def reset(self) -> None:
        """Put the robot at home, at rest."""
        qpos = np.append(physics_settings.HOME, [physics_settings.FINGER_OPEN] * 2)
        self.articulation.set_qpos(qpos)
        self.articulation.set_qvel(np.zeros_like(qpos))
        self.articulation.set_qf(np.zeros_like(qpos))
        for joint, target in zip(self._joints, qpos, strict=True):
            joint.set_drive_target(float(target))

    def set_targets(self, action: Actions) -> None:
        """Set the drive targets of an action (8): seven joints (rad) and the gripper in [-1, 1]."""
        for joint, target in zip(self._joints[:ARM_JOINTS], action[:ARM_JOINTS], strict=True):
            joint.set_drive_target(float(target))
        gripper = min(max(float(action[ARM_JOINTS]), -1.0), 1.0)
        share = (gripper + 1.0) / 2.0  # 0 for closed, 1 for open
        span = physics_settings.FINGER_OPEN - physics_settings.FINGER_SQUEEZE
        for joint in self._joints[ARM_JOINTS:]:
            joint.set_drive_target(physics_settings.FINGER_SQUEEZE + share * span)

    @property
    def arm_positions(self) -> NDArray[np.float64]:
        """Joint positions of the arm (7), rad."""
        return np.asarray(self.articulation.get_qpos()[:ARM_JOINTS], dtype=np.float64)

    @property
    def finger_positions(self) -> NDArray[np.float64]:
        """Positions of the two fingers, m: 0 closed, 0.04 open."""
        return np.asarray(self.articulation.get_qpos()[ARM_JOINTS:], dtype=np.float64)

    @property
    def tool_pose(self) -> sapien.Pose:
        """Pose of the tool center point between the fingertips, world frame."""
        return self.tool.entity_pose

    def is_still(self) -> bool:
        """Return whether no arm joint moves faster than 0.2 rad/s."""
        speeds = np.abs(self.articulation.get_qvel()[:ARM_JOINTS])
        return bool(speeds.max() <= STILL_SPEED)

    def grasps(
        self, body: sapien.physx.PhysxBaseComponent, contacts: list[sapien.physx.PhysxContact]
    ) -> bool:
        """Return whether both fingers push a body hard enough, in about their closing direction.

        The force on a finger must be `GRASP_FORCE` or more, and at most `GRASP_ANGLE` from the
        direction in which the finger opens (ManiSkill's rule).

        Args:
            body: the component that collides.
            contacts: those of the last physics step.
        """
        for finger, sign in zip(self._fingers, OPENING_SIGNS, strict=True):
            force = _force_on(finger, body, contacts)
            size = float(np.linalg.norm(force))
            if size < GRASP_FORCE:
                return False
            y_axis = finger.entity_pose.to_transformation_matrix()[:3, 1]
            cosine = float(np.dot(sign * y_axis, force)) / size
            angle = math.acos(min(max(cosine, -1.0), 1.0))
            if angle > GRASP_ANGLE:
                return False
        return True


def rotation_of(pose: sapien.Pose) -> Rotation:
    """Return the rotation of a pose; SAPIEN's quaternions put the scalar first, SciPy's last."""
    # Importing SciPy takes a quarter of a second, and only planning needs it.
    from scipy.spatial.transform import Rotation

    w, x, y, z = np.asarray(pose.q, dtype=np.float64)
    return Rotation.from_quat([x, y, z, w])


def _render_body(
    records: Sequence[Any], rendering: RenderSettings, fixed_at: sapien.Pose | None = None
) -> sapien.render.RenderBodyComponent:
    """Return the meshes of a link as one render body, which is in no scene yet.

    Args:
        records: SAPIEN's visual records of the link's meshes.
        rendering: how pictures are drawn.
        fixed_at: fixed pose of the link in the world frame; keeps only what reaches a pixel of the
            front camera there.
    """
    body = sapien.render.RenderBodyComponent()
    for record in records:
        mesh_at = None if fixed_at is None else fixed_at * record.pose
        for shape in link_shapes(Path(record.filename), record.material, rendering, mesh_at):
            shape.local_pose = record.pose
            body.attach(shape)
    return body


def _hull(records: Sequence[Any], rendering: RenderSettings) -> NDArray[np.float64]:
    """Return the vertices (n, 3) of the convex hulls of a link's meshes, m in the link's frame."""
    hulls = []
    for record in records:
        matrix = record.pose.to_transformation_matrix()
        hull = link_hull(Path(record.filename), rendering)
        hulls.append(transformed(hull, matrix))
    return np.concatenate(hulls)


def _force_on(
    finger: sapien.physx.PhysxArticulationLinkComponent,
    body: sapien.physx.PhysxBaseComponent,
    contacts: list[sapien.physx.PhysxContact],
) -> NDArray[np.float64]:
    """Return the mean force of `body` on `finger` in the last physics step, N, world frame."""
    impulse = np.zeros(3)
    for contact in contacts:
        first, second = contact.bodies
        if first == finger and second == body:
            sign = 1.0
        elif first == body and second == finger:
            sign = -1.0  # SAPIEN gives the impulse on the first body
        else:
            continue
        for point in contact.points:
            impulse += sign * point.impulse
    return impulse * physics_settings.PHYSICS_RATE


class _PandaLoader(URDFLoader):  # type: ignore[misc]  # SAPIEN's wrappers have no types
    """Parses the robot's description.

    Args:
        visible: whether the robot is drawn.
        stock: whether to build it with the installed meshes.

    Attributes:
        builder: builds the robot, any number of times.
        visuals: visual records of the meshes that the builder leaves out, by link.
    """

    def __init__(self, *, visible: bool, stock: bool) -> None:
        super().__init__()
        self._visible = visible
        self._stock = stock
        self.visuals: dict[str, list[Any]] = {}
        self.fix_root_link = True
        # Parsing needs a scene too; the scene to build in is set later.
        self.set_scene(sapien.Scene([sapien.physx.PhysxCpuSystem()]))
        for finger in FINGERS:
            self.set_link_material(finger, FINGER_FRICTION, FINGER_FRICTION, 0.0)
            self.set_link_patch_radius(finger, FINGER_PATCH)
            self.set_link_min_patch_radius(finger, FINGER_PATCH)
        urdf = find_model_files() / ROBOT_FILE
        builders, _, _ = self.parse(str(urdf), str(urdf.with_suffix(".srdf")))
        self.builder = builders[0]

    def _build_link(self, link: Any, link_builder: Any) -> None:  # noqa: ANN401
        """Build a link; note its meshes apart, so that others can be drawn in their place."""
        if not self._visible:
            link.visuals.clear()
        super()._build_link(link, link_builder)
        if link_builder.visual_records and not self._stock:
            self.visuals[link.name] = link_builder.visual_records[:]
            link_builder.visual_records.clear()


def with_gripper(joints: NDArray[np.float64], gripper: float) -> JointTrajectory:
    """Return a trajectory of joint targets (n, 7) with the same gripper in every row."""
    return np.column_stack([joints, np.full(len(joints), gripper)])


@functools.cache
def _loader(visible: bool, stock: bool) -> _PandaLoader:
    """Return the parsed description, cached because parsing takes longer than building."""
    return _PandaLoader(visible=visible, stock=stock)
