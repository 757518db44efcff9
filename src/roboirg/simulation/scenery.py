"""The table and the floor, as in ManiSkill's table scene."""

from __future__ import annotations

import functools
import math

import numpy as np
import sapien
import sapien.render
from numpy.typing import NDArray
from sapien.wrapper.actor_builder import ActorBuilder

from roboirg.simulation.model_files import GROUND_FILE, TABLE_FILE, find_model_files
from roboirg.simulation.rendering.render_settings import FAITHFUL, RenderSettings
from roboirg.simulation.rendering.table_mesh import table_shape

Range = tuple[int, int]
"""First square and the one after the last, along an axis of the floor."""

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
    table = _add_table(scene, has_stock_mesh=visible and rendering.meshes == "stock")
    if visible and rendering.meshes != "stock":
        _draw_table(table)
    floor = _add_floor(scene)
    if visible:
        _draw_floor(floor, rendering)


def _add_table(scene: sapien.Scene, *, has_stock_mesh: bool) -> sapien.Entity:
    """Add the table without its mesh, or with the installed one."""
    builder = ActorBuilder()
    builder.set_scene(scene)
    builder.add_box_collision(sapien.Pose([0.0, 0.0, TABLE_HEIGHT / 2]), half_size=TABLE_HALF)
    if has_stock_mesh:
        file = find_model_files() / TABLE_FILE
        builder.add_visual_from_file(str(file), sapien.Pose(q=QUARTER_TURN), [TABLE_SCALE] * 3)
    builder.set_physx_body_type("kinematic")
    builder.set_initial_pose(sapien.Pose(TABLE_POSITION, QUARTER_TURN))
    return builder.build(name="table")


def _draw_table(table: sapien.Entity) -> None:
    """Add the mesh whose textures are decoded once."""
    shape = table_shape().clone()
    shape.scale = [TABLE_SCALE] * 3
    shape.local_pose = sapien.Pose(q=QUARTER_TURN)
    component = sapien.render.RenderBodyComponent()
    component.attach(shape)
    table.add_component(component)


def _add_floor(scene: sapien.Scene) -> sapien.Entity:
    """Add the floor, a plane, without a mesh."""
    builder = ActorBuilder()
    builder.set_scene(scene)
    builder.add_plane_collision(sapien.Pose([0.0, 0.0, -TABLE_HEIGHT], PLANE_UP))
    builder.set_physx_body_type("static")
    return builder.build(name="floor")


def _draw_floor(floor: sapien.Entity, rendering: RenderSettings) -> None:
    """Add the floor's meshes: of squares as in the stock mesh, or of larger ones."""
    pieces = WHOLE_FLOOR if rendering.meshes == "stock" else FLOOR_PIECES
    for along_x, along_y in pieces:
        is_near = (along_x, along_y) == NEAR_FLOOR
        step = FAR_FLOOR_STEP
        if rendering.meshes == "stock" or (is_near and rendering.meshes != "light"):
            step = 1
        component = sapien.render.RenderBodyComponent()
        component.attach(_floor_piece(along_x, along_y, step).clone())
        floor.add_component(component)


@functools.cache
def _floor_piece(
    along_x: Range, along_y: Range, step: int
) -> sapien.render.RenderShapeTriangleMesh:
    """Return a range of the floor's squares along x and y as a textured mesh.

    Args:
        along_x: range of squares.
        along_y: range of squares.
        step: number of squares per side that are merged into one; it divides both ranges.
    """
    x_ticks = _floor_ticks(along_x, step)
    y_ticks = _floor_ticks(along_y, step)
    grid = np.stack(np.meshgrid(x_ticks, y_ticks, indexing="ij"), axis=-1)
    points = grid.reshape(-1, 2)
    vertices = np.column_stack([points, np.full(len(points), -TABLE_HEIGHT)])
    texture_places = points * FLOOR_TEXTURE_REPEATS / FLOOR_WIDTH + 0.5
    material = sapien.render.RenderMaterial()
    material.base_color_texture = sapien.render.RenderTexture2D(
        filename=str(find_model_files() / GROUND_FILE), mipmap_levels=4
    )
    return sapien.render.RenderShapeTriangleMesh(
        vertices=vertices.astype(np.float32),
        triangles=_grid_triangles(len(x_ticks), len(y_ticks)).astype(np.uint32),
        normals=np.tile(np.array([0.0, 0.0, 1.0], np.float32), (len(points), 1)),
        uvs=texture_places.astype(np.float32),
        material=material,
    )


def _floor_ticks(squares: Range, step: int) -> NDArray[np.float64]:
    """Return the coordinates of the lines around a range of the floor's squares, m.

    With 100 squares of 1 m, squares 40 to 60 and a step of 20 → [-10, 10].
    """
    ticks = np.linspace(-FLOOR_WIDTH / 2, FLOOR_WIDTH / 2, FLOOR_CELLS + 1)
    first, end = squares
    return ticks[first : end + 1 : step]


def _grid_triangles(columns: int, rows: int) -> NDArray[np.intp]:
    """Return the triangles of a grid of vertices, as vertex numbers, (n, 3), two for each square.

    Vertices are numbered column by column: along y first.
    """
    numbers = np.arange(columns * rows).reshape(columns, rows)
    # The corners of each square: near and far along y, in its own column and the next.
    near = numbers[:-1, :-1].ravel()
    far = near + 1
    next_near = near + rows
    next_far = next_near + 1
    first_halves = np.stack([near, next_near, far], axis=1)
    second_halves = np.stack([next_near, next_far, far], axis=1)
    return np.concatenate([first_halves, second_halves])
