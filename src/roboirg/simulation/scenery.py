"""The table and the floor, as in ManiSkill's table scene."""

from __future__ import annotations

import math

import numpy as np
import sapien
import sapien.render
from sapien.wrapper.actor_builder import ActorBuilder

from roboirg.simulation.assets import find_model_files

TABLE_HEIGHT = 0.9196429
TABLE_HALF = (2.418 / 2, 1.209 / 2, TABLE_HEIGHT / 2)
TABLE_POSITION = (-0.12, 0.0, -TABLE_HEIGHT)
TABLE_SCALE = 1.75
QUARTER_TURN = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))

FLOOR_WIDTH = 100.0
FLOOR_CELLS = 10
"""Squares per side. ManiSkill draws 100; with 10 single wrist pixels differ by one level."""
FLOOR_TEXTURE_REPEATS = 25.0
"""Repeats of the grid texture over the floor's width."""
PLANE_UP = (0.7071068, 0.0, -0.7071068, 0.0)


def add_scenery(scene: sapien.Scene, *, visible: bool) -> None:
    """Add the table, whose top is at z = 0, and the floor under it."""
    _add_table(scene, visible=visible)
    _add_floor(scene, visible=visible)


def _add_table(scene: sapien.Scene, *, visible: bool) -> None:
    builder = ActorBuilder()
    builder.set_scene(scene)
    builder.add_box_collision(sapien.Pose([0.0, 0.0, TABLE_HEIGHT / 2]), half_size=TABLE_HALF)
    if visible:
        builder.add_visual_from_file(
            str(find_model_files().table), sapien.Pose(q=QUARTER_TURN), [TABLE_SCALE] * 3
        )
    builder.set_physx_body_type("kinematic")
    builder.set_initial_pose(sapien.Pose(TABLE_POSITION, QUARTER_TURN))
    builder.build(name="table")


def _add_floor(scene: sapien.Scene, *, visible: bool) -> None:
    builder = ActorBuilder()
    builder.set_scene(scene)
    builder.add_plane_collision(sapien.Pose([0.0, 0.0, -TABLE_HEIGHT], PLANE_UP))
    builder.set_physx_body_type("static")
    floor = builder.build(name="floor")
    if visible:
        component = sapien.render.RenderBodyComponent()
        component.attach(_floor_mesh())
        floor.add_component(component)


def _floor_mesh() -> sapien.render.RenderShapeTriangleMesh:
    """A square grid of triangles with the grid texture on it."""
    ticks = np.linspace(-FLOOR_WIDTH / 2, FLOOR_WIDTH / 2, FLOOR_CELLS + 1)
    x, y = (axis.ravel() for axis in np.meshgrid(ticks, ticks, indexing="ij"))
    vertices = np.stack([x, y, np.full_like(x, -TABLE_HEIGHT)], axis=1)
    corner = np.arange(FLOOR_CELLS)[:, None] * (FLOOR_CELLS + 1) + np.arange(FLOOR_CELLS)
    near, right = corner.ravel(), corner.ravel() + FLOOR_CELLS + 1
    triangles = np.concatenate(
        [np.stack([near, right, near + 1], axis=1), np.stack([right, right + 1, near + 1], axis=1)]
    )
    material = sapien.render.RenderMaterial()
    material.base_color_texture = sapien.render.RenderTexture2D(
        filename=str(find_model_files().ground_texture), mipmap_levels=4
    )
    return sapien.render.RenderShapeTriangleMesh(
        vertices=vertices.astype(np.float32),
        triangles=triangles.astype(np.uint32),
        normals=np.tile(np.array([0.0, 0.0, 1.0], np.float32), (len(vertices), 1)),
        uvs=(vertices[:, :2] * FLOOR_TEXTURE_REPEATS / FLOOR_WIDTH + 0.5).astype(np.float32),
        material=material,
    )
