"""The table and the floor, as in ManiSkill's table scene."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np
import sapien
import sapien.render
from sapien.wrapper.actor_builder import ActorBuilder

from roboirg.simulation.model_files import GROUND_FILE, TABLE_FILE, find_model_files
from roboirg.simulation.rendering.render_settings import FAITHFUL, RenderSettings
from roboirg.simulation.rendering.table_mesh import table_shape

Range = tuple[int, int]

TABLE_HEIGHT = 0.9196429
TABLE_HALF = (2.418 / 2, 1.209 / 2, TABLE_HEIGHT / 2)
TABLE_POSITION = (-0.12, 0.0, -TABLE_HEIGHT)
TABLE_SCALE = 1.75
QUARTER_TURN = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))

FLOOR_WIDTH = 100.0
FLOOR_CELLS = 100
"""Squares per side; with fewer, single wrist pixels would differ by one level."""
FAR_FLOOR_STEP = 20
"""Squares merged per side far from the table, where no pixel changes, and in light meshes."""
NEAR_FLOOR = ((40, 60), (40, 60))
FLOOR_PIECES = (
    NEAR_FLOOR,
    ((40, 60), (0, 40)),
    ((40, 60), (60, 100)),
    ((0, 40), (0, 100)),
    ((60, 100), (0, 100)),
)
"""Ranges of the floor's squares along x and y, in pieces that are culled separately: most
views show only the first, which has the table at its center."""
WHOLE_FLOOR = (((0, 100), (0, 100)),)
FLOOR_TEXTURE_REPEATS = 25.0
"""Repeats of the grid texture over the floor's width."""
PLANE_UP = (0.7071068, 0.0, -0.7071068, 0.0)


def add_scenery(
    scene: sapien.Scene, *, visible: bool, rendering: RenderSettings = FAITHFUL
) -> None:
    """Add the table, whose top is at z = 0, and the floor under it."""
    _add_table(scene, visible=visible, rendering=rendering)
    pieces = WHOLE_FLOOR if rendering.meshes == "stock" else FLOOR_PIECES
    _add_floor(scene, pieces if visible else (), rendering)


def _add_table(scene: sapien.Scene, *, visible: bool, rendering: RenderSettings) -> None:
    builder = ActorBuilder()
    builder.set_scene(scene)
    builder.add_box_collision(sapien.Pose([0.0, 0.0, TABLE_HEIGHT / 2]), half_size=TABLE_HALF)
    turned = sapien.Pose(q=QUARTER_TURN)
    stock = rendering.meshes == "stock"
    if visible and stock:
        builder.add_visual_from_file(
            str(find_model_files() / TABLE_FILE), turned, [TABLE_SCALE] * 3
        )
    builder.set_physx_body_type("kinematic")
    builder.set_initial_pose(sapien.Pose(TABLE_POSITION, QUARTER_TURN))
    table = builder.build(name="table")
    if visible and not stock:
        shape = table_shape().clone()
        shape.scale, shape.local_pose = [TABLE_SCALE] * 3, turned
        component = sapien.render.RenderBodyComponent()
        component.attach(shape)
        table.add_component(component)


def _add_floor(
    scene: sapien.Scene, pieces: Sequence[tuple[Range, Range]], rendering: RenderSettings
) -> None:
    builder = ActorBuilder()
    builder.set_scene(scene)
    builder.add_plane_collision(sapien.Pose([0.0, 0.0, -TABLE_HEIGHT], PLANE_UP))
    builder.set_physx_body_type("static")
    floor = builder.build(name="floor")
    for along_x, along_y in pieces:
        near = (along_x, along_y) == NEAR_FLOOR and rendering.meshes != "light"
        step = 1 if near or rendering.meshes == "stock" else FAR_FLOOR_STEP
        component = sapien.render.RenderBodyComponent()
        component.attach(_floor_piece(along_x, along_y, step).clone())
        floor.add_component(component)


@functools.cache
def _floor_piece(
    along_x: Range, along_y: Range, step: int
) -> sapien.render.RenderShapeTriangleMesh:
    """Return a range of the floor's squares along x and y as a textured mesh."""
    ticks = np.linspace(-FLOOR_WIDTH / 2, FLOOR_WIDTH / 2, FLOOR_CELLS + 1)
    columns, rows = ((along[1] - along[0]) // step for along in (along_x, along_y))
    x, y = (
        axis.ravel()
        for axis in np.meshgrid(
            ticks[along_x[0] : along_x[1] + 1 : step],
            ticks[along_y[0] : along_y[1] + 1 : step],
            indexing="ij",
        )
    )
    vertices = np.stack([x, y, np.full_like(x, -TABLE_HEIGHT)], axis=1)
    corner = np.arange(columns)[:, None] * (rows + 1) + np.arange(rows)
    near, right = corner.ravel(), corner.ravel() + rows + 1
    triangles = np.concatenate(
        [np.stack([near, right, near + 1], axis=1), np.stack([right, right + 1, near + 1], axis=1)]
    )
    material = sapien.render.RenderMaterial()
    material.base_color_texture = sapien.render.RenderTexture2D(
        filename=str(find_model_files() / GROUND_FILE), mipmap_levels=4
    )
    return sapien.render.RenderShapeTriangleMesh(
        vertices=vertices.astype(np.float32),
        triangles=triangles.astype(np.uint32),
        normals=np.tile(np.array([0.0, 0.0, 1.0], np.float32), (len(vertices), 1)),
        uvs=(vertices[:, :2] * FLOOR_TEXTURE_REPEATS / FLOOR_WIDTH + 0.5).astype(np.float32),
        material=material,
    )
