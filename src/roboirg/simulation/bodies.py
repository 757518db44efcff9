"""Objects of a scene as SAPIEN bodies: shapes, masses and colors as in RoboMME.

Boxes and rolls of tape are our own. Another package adds a kind of object with
`register_body_builder`, in the module of the task that uses it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import sapien
import sapien.physx
import sapien.render
from sapien.wrapper.actor_builder import ActorBuilder
from sapien.wrapper.articulation_builder import ArticulationBuilder

from roboirg.core import object_sizes
from roboirg.core.episode import ObjectKind, SceneObject
from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.motions import Point
from roboirg.simulation.rendering.tube_mesh import Rgba, tube_mesh

# SAPIEN takes half sizes everywhere: half sides, half heights, half thicknesses.
Triple = tuple[float, float, float]
Cuboid = tuple[Triple, Triple]
"""Center and half sides in the object's frame, m."""

COLOR_RGBA: dict[str, Rgba] = {
    "red": (1.0, 0.0, 0.0, 1.0),
    "green": (0.0, 1.0, 0.0, 1.0),
    "blue": (0.0, 0.0, 1.0, 1.0),
    "yellow": (1.0, 0.8, 0.0, 1.0),
    "gray": (0.5, 0.5, 0.5, 1.0),
    "purple": (160 / 255, 32 / 255, 240 / 255, 1.0),
}
WHITE: Rgba = (1.0, 1.0, 1.0, 1.0)
GRAY: Rgba = COLOR_RGBA["gray"]
PURPLE: Rgba = COLOR_RGBA["purple"]
RED: Rgba = COLOR_RGBA["red"]
WOOD: Rgba = (0.8, 0.6, 0.4, 1.0)
BLACK: Rgba = (0.0, 0.0, 0.0, 1.0)

UPRIGHT = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
"""Turns SAPIEN's cylinders, which lie along x, upright."""
JOINT_UP = (math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0)
"""Turns the frames of SAPIEN's prismatic joints, which slide along x, so that x points up."""
UPSIDE_DOWN = (0.0, 1.0, 0.0, 0.0)
RING_SHARES = (1.0, 0.8, 0.6, 0.4, 0.2)
"""Radii of a disc's rings, in radii of the disc."""
RING_STEP = 1e-5
"""Meters by which each ring is higher than the next larger one, which it covers."""
CAP_DENSITY = 1500.0
FLOOR_SHADE = 0.5
"""Brightness of a box's floor in that of its walls: no shadow shows its depth."""
BUTTON_STIFFNESS = 800.0
BUTTON_DAMPING = 40.0


@dataclass
class Body:
    """A scene object in the simulator.

    Attributes:
        item: the data it was built from.
        entity: the entity that moves (of a button: its base).
        physics: the component that collides.
        button: of a button: the articulation whose only joint is the cap's.
    """

    item: SceneObject
    entity: sapien.Entity
    physics: sapien.physx.PhysxBaseComponent | None = None
    button: sapien.physx.PhysxArticulation | None = None

    @property
    def position(self) -> Point:
        """Position of the object's origin, world frame, m."""
        return Point(*self.entity.pose.p.tolist())

    @property
    def yaw(self) -> float:
        """Rotation about the vertical, rad."""
        x_axis = self.entity.pose.to_transformation_matrix()[:, 0]
        return math.atan2(x_axis[1], x_axis[0])

    def put(self, position: Point) -> None:
        """Teleport the object, upright and at rest, with its own yaw."""
        self.set_pose(_pose(self.item, position))

    def set_pose(self, pose: sapien.Pose) -> None:
        """Teleport the object; it is at rest afterwards."""
        self.entity.set_pose(pose)
        if isinstance(self.physics, sapien.physx.PhysxRigidDynamicComponent):
            self.physics.set_linear_velocity(np.zeros(3))
            self.physics.set_angular_velocity(np.zeros(3))

    @property
    def segment(self) -> int:
        """The object's number in segmented pictures; of a button only its cap counts (RoboMME)."""
        entity = self.entity if self.button is None else self.button.links[1].entity
        return int(entity.per_scene_id)

    @property
    def pressed_depth(self) -> float:
        """Distance by which a button's cap is down, m; 0 for other objects."""
        if self.button is None:
            return 0.0
        return -float(self.button.get_qpos()[0])


BodyBuilder = Callable[[sapien.Scene, SceneObject, bool], Body]
"""Adds an object to a scene, with visual shapes if the flag is True."""


def build(scene: sapien.Scene, item: SceneObject, *, visible: bool) -> Body:
    """Add an object to a scene, with or without its visual shapes."""
    check_names("kind of object", [item.kind], BODY_BUILDERS)
    return BODY_BUILDERS[item.kind](scene, item, visible)


def register_body_builder(kind: ObjectKind, builder: BodyBuilder) -> None:
    """Add a kind of object. Adding the same one again changes nothing.

    Args:
        kind: the new kind.
        builder: adds an object of the kind to a scene, given whether it has visual shapes, for
            example with `finish_body`.

    Raises:
        InvalidValueError: the kind exists with another builder.
    """
    if _BUILDERS.setdefault(kind, builder) is not builder:
        raise InvalidValueError(
            f"There is already a kind of object {kind!r} with another builder; choose another name."
        )


def _pose(item: SceneObject, position: Point) -> sapien.Pose:
    """Return the pose of an object that stands at a position, with its own yaw."""
    half = item.yaw / 2.0
    pose = sapien.Pose(position, [math.cos(half), 0.0, 0.0, math.sin(half)])
    if item.kind == "container":
        return pose * sapien.Pose(q=UPSIDE_DOWN)
    return pose


def _material(rgba: Rgba) -> sapien.render.RenderMaterial:
    """Return SAPIEN's usual material in a color."""
    return sapien.render.RenderMaterial(base_color=list(rgba))


def _rgba(item: SceneObject, usual: Rgba) -> Rgba:
    """Return the color that the scene gives an object; the usual one of its kind without."""
    if item.rgb is None:
        return usual
    return (*item.rgb, 1.0)


def finish_body(
    builder: ActorBuilder, scene: sapien.Scene, item: SceneObject, body_type: str
) -> Body:
    """Build an actor with all its shapes where its object stands, and return it as a body.

    Args:
        builder: has the shapes.
        scene: to which it is added.
        item: the object.
        body_type: ``dynamic`` if it moves by physics, ``kinematic`` if only by itself.
    """
    builder.set_scene(scene)
    builder.set_physx_body_type(body_type)
    builder.set_initial_pose(_pose(item, item.position))
    entity = builder.build(name=item.name)
    physics = entity.find_component_by_type(sapien.physx.PhysxRigidBaseComponent)
    return Body(item, entity, physics)


def _build_cube(scene: sapien.Scene, item: SceneObject, visible: bool) -> Body:
    """Build a cube; one that is hidden in a container is smaller."""
    half = object_sizes.HIDDEN_CUBE_HALF if item.kind == "hidden_cube" else object_sizes.CUBE_HALF
    builder = ActorBuilder()
    builder.add_box_collision(half_size=[half] * 3)
    if visible:
        material = _material(COLOR_RGBA[str(item.color)])
        builder.add_box_visual(half_size=[half] * 3, material=material)
    return finish_body(builder, scene, item, "dynamic")


def _build_container(scene: sapien.Scene, item: SceneObject, visible: bool) -> Body:
    """Build six boxes, upside down; the gripper grasps the knob."""
    half_wall = object_sizes.CONTAINER_WALL / 2
    half_side = object_sizes.CONTAINER_HALF
    half_roof = object_sizes.CONTAINER_ROOF / 2
    half_height = object_sizes.CONTAINER_WALL_HEIGHT / 2
    # Upside down, z is measured from the origin (the roof's top) towards the opening.
    wall_z = object_sizes.CONTAINER_HEIGHT - half_height
    boxes = [
        ((0.0, 0.0, half_roof), (half_side, half_side, half_roof)),
        ((-half_side, 0.0, wall_z), (half_wall, half_side, half_height)),
        ((half_side, 0.0, wall_z), (half_wall, half_side, half_height)),
        ((0.0, -half_side, wall_z), (half_side, half_wall, half_height)),
        ((0.0, half_side, wall_z), (half_side, half_wall, half_height)),
        ((0.0, 0.0, 0.0), (object_sizes.CUBE_HALF,) * 3),  # the knob
    ]
    builder = ActorBuilder()
    _add_boxes(builder, boxes, WHITE if visible else None)
    return finish_body(builder, scene, item, "dynamic")


def _build_target(scene: sapien.Scene, item: SceneObject, visible: bool) -> Body:
    """Build a target, purple unless the scene gives a color, without collision shapes."""
    builder = ActorBuilder()
    if visible:
        thickness = item.thickness or object_sizes.TARGET_THICKNESS
        _add_rings(builder, item, _rgba(item, PURPLE), thickness / 2)
    return finish_body(builder, scene, item, "kinematic")


def _build_marker(scene: sapien.Scene, item: SceneObject, visible: bool) -> Body:
    """Build a red disc that is thick enough to cover a target, without collision shapes."""
    builder = ActorBuilder()
    if visible:
        _add_rings(builder, item, RED, object_sizes.MARKER_HALF_THICKNESS)
    return finish_body(builder, scene, item, "kinematic")


def _add_rings(builder: ActorBuilder, item: SceneObject, rgba: Rgba, half_height: float) -> None:
    """Add five concentric discs, colored and white in turn; the smaller ones rise a bit higher.

    Args:
        builder: of the target or marker.
        item: with the radius of the largest disc, m.
        rgba: color of the first, third and fifth disc.
        half_height: half the thickness of the largest one, m.
    """
    radius = float(item.radius or 0.0)
    for number, share in enumerate(RING_SHARES):
        color = WHITE if number % 2 else rgba
        builder.add_cylinder_visual(
            sapien.Pose(q=UPRIGHT),
            radius=radius * share,
            half_length=half_height + number * RING_STEP,
            material=_material(color),
        )


def _build_site(scene: sapien.Scene, item: SceneObject, visible: bool) -> Body:
    """Build an invisible place without collision shapes."""
    del visible
    return finish_body(ActorBuilder(), scene, item, "kinematic")


def _build_shuttle(scene: sapien.Scene, item: SceneObject, visible: bool) -> Body:
    """Build a cube without collision shapes."""
    builder = ActorBuilder()
    if visible:
        material = _material(_rgba(item, WHITE))
        builder.add_box_visual(half_size=[object_sizes.CUBE_HALF] * 3, material=material)
    return finish_body(builder, scene, item, "kinematic")


def _build_bin(scene: sapien.Scene, item: SceneObject, visible: bool) -> Body:
    """Build four walls and a black floor without collision: objects fall to the table."""
    half_height = object_sizes.BIN_HEIGHT / 2
    builder = ActorBuilder()
    walls = _walls(object_sizes.BIN_HALF, object_sizes.BIN_WALL / 2, half_height)
    _add_boxes(builder, walls, WOOD if visible else None)
    if visible:
        half_floor = object_sizes.BIN_FLOOR_HEIGHT / 2
        half_hole = object_sizes.BIN_HOLE_HALF
        builder.add_box_visual(
            sapien.Pose([0.0, 0.0, half_floor - half_height]),
            half_size=(half_hole, half_hole, half_floor),
            material=_material(BLACK),
        )
    return finish_body(builder, scene, item, "kinematic")


def _build_box(scene: sapien.Scene, item: SceneObject, visible: bool) -> Body:
    """Build four walls and a floor, fixed to the table."""
    half_height = object_sizes.BOX_HEIGHT / 2
    half_floor = object_sizes.BOX_FLOOR / 2
    half_hole = object_sizes.BOX_HALF - object_sizes.BOX_WALL
    walls = _walls(object_sizes.BOX_HALF, object_sizes.BOX_WALL / 2, half_height)
    floor = ((0.0, 0.0, half_floor - half_height), (half_hole, half_hole, half_floor))
    color = COLOR_RGBA[str(item.color)]
    builder = ActorBuilder()
    _add_boxes(builder, walls, color if visible else None)
    _add_boxes(builder, [floor], _darkened(color) if visible else None)
    return finish_body(builder, scene, item, "kinematic")


def _darkened(rgba: Rgba) -> Rgba:
    """Return the color of a box's floor, given that of its walls."""
    red, green, blue, opacity = rgba
    return (FLOOR_SHADE * red, FLOOR_SHADE * green, FLOOR_SHADE * blue, opacity)


def _walls(half_side: float, half_wall: float, half_height: float) -> list[Cuboid]:
    """Return four walls around a square.

    Args:
        half_side: half the square's outer side, m.
        half_wall: half the walls' thickness, m.
        half_height: half their height, m.
    """
    center = half_side - half_wall
    half_hole = half_side - 2 * half_wall
    walls = []
    for sign in (-1.0, 1.0):
        walls.append(((0.0, sign * center, 0.0), (half_side, half_wall, half_height)))
        walls.append(((sign * center, 0.0, 0.0), (half_wall, half_hole, half_height)))
    return walls


def _add_boxes(builder: ActorBuilder, cuboids: Sequence[Cuboid], rgba: Rgba | None) -> None:
    """Add boxes with collision shapes and, with a color, visual shapes; None draws nothing."""
    for center, half in cuboids:
        builder.add_box_collision(sapien.Pose(center), half_size=half)
        if rgba is not None:
            material = _material(rgba)
            builder.add_box_visual(sapien.Pose(center), half_size=half, material=material)


def _build_tape(scene: sapien.Scene, item: SceneObject, visible: bool) -> Body:
    """Build a roll of tape: collision is by a ring of boxes, and what is drawn is a round tube.

    It can be grasped from outside or by its wall.
    """
    outer = object_sizes.TAPE_RADIUS
    inner = object_sizes.TAPE_HOLE_RADIUS
    half_height = object_sizes.TAPE_HALF
    half_wall = (outer - inner) / 2
    half_side = outer * math.tan(math.pi / object_sizes.TAPE_SIDES)
    builder = ActorBuilder()
    for number in range(object_sizes.TAPE_SIDES):
        angle = 2 * math.pi * number / object_sizes.TAPE_SIDES
        pose = _pose_on_circle(inner + half_wall, angle)
        builder.add_box_collision(pose, half_size=(half_wall, half_side, half_height))
    body = finish_body(builder, scene, item, "dynamic")
    if visible:
        component = sapien.render.RenderBodyComponent()
        mesh = tube_mesh(outer, inner, half_height, COLOR_RGBA[str(item.color)])
        component.attach(mesh.clone())
        body.entity.add_component(component)
    return body


def _pose_on_circle(radius: float, angle: float) -> sapien.Pose:
    """Return the pose of a point on a circle around the origin, with x away from the origin."""
    center = (math.cos(angle) * radius, math.sin(angle) * radius, 0.0)
    return sapien.Pose(center, [math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)])


def _build_button(scene: sapien.Scene, item: SceneObject, visible: bool) -> Body:
    """Build a base and a cap on a sprung vertical joint, an articulation of two links.

    The joint's position is 0 at rest and negative when pressed, down to `BUTTON_TRAVEL`.
    """
    base_half = object_sizes.BUTTON_BASE_HALF
    cap_size = {
        "radius": object_sizes.BUTTON_CAP_RADIUS,
        "half_length": object_sizes.BUTTON_CAP_HALF_LENGTH,
    }
    upright = sapien.Pose(q=UPRIGHT)
    builder = ArticulationBuilder()
    builder.set_scene(scene)
    builder.set_initial_pose(_pose(item, item.position))
    base = builder.create_link_builder()
    base.set_name("button_base")
    base.add_box_collision(half_size=base_half)
    cap = builder.create_link_builder(base)
    cap.set_name("button_cap")
    cap.set_joint_name("button_joint")
    rest = base_half[2] + object_sizes.BUTTON_CAP_HALF_LENGTH
    cap.set_joint_properties(
        "prismatic",
        [[-object_sizes.BUTTON_TRAVEL, 0.0]],
        sapien.Pose([0.0, 0.0, rest], JOINT_UP),
        sapien.Pose([0.0, 0.0, 0.0], JOINT_UP),
    )
    cap.add_cylinder_collision(upright, density=CAP_DENSITY, **cap_size)
    if visible:
        base.add_box_visual(half_size=base_half, material=_material(WHITE))
        cap.add_cylinder_visual(upright, material=_material(GRAY), **cap_size)
    articulation = builder.build(fix_root_link=True)
    articulation.set_name(item.name)
    _add_spring(articulation)
    base_link, cap_link = articulation.links
    return Body(item, base_link.entity, cap_link, articulation)


def _add_spring(articulation: sapien.physx.PhysxArticulation) -> None:
    """Let a spring hold the joint of a button at rest."""
    articulation.set_qpos(np.zeros(1))
    joint = articulation.active_joints[0]
    joint.set_drive_properties(BUTTON_STIFFNESS, BUTTON_DAMPING, mode="force")
    joint.set_drive_target(0.0)


_BUILDERS: dict[ObjectKind, BodyBuilder] = {
    "cube": _build_cube,
    "hidden_cube": _build_cube,
    "container": _build_container,
    "target": _build_target,
    "button": _build_button,
    "bin": _build_bin,
    "site": _build_site,
    "shuttle": _build_shuttle,
    "marker": _build_marker,
    "box": _build_box,
    "tape": _build_tape,
}

BODY_BUILDERS: Mapping[ObjectKind, BodyBuilder] = MappingProxyType(_BUILDERS)
"""Every kind of object, those of other packages included."""
