"""Draw the objects of several tasks: buttons, cubes, target discs, bins.

What finds no free place raises `SceneRejectedError`: the seed gives no scene.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Literal, NamedTuple

import numpy as np

from roboirg.core import object_sizes
from roboirg.core.episode import (
    COLORS,
    Color,
    Difficulty,
    Goal,
    ObjectKind,
    Scene,
    SceneObject,
    SlotValue,
)
from roboirg.core.errors import SceneRejectedError
from roboirg.core.footprints import Circle, Footprint, Line, Obstacle, Rectangle, Region, place
from roboirg.core.motions import Point
from roboirg.util.random_draws import shuffled

CUBES: dict[Difficulty, int] = {"easy": 1, "medium": 3, "hard": 3}
"""Cubes of different colors on the table."""
BUTTON_REGION = Region(-0.2, 0.0, 0.05, 0.2)
"""Where the button of most tasks is."""
ORDINALS = ("first", "second", "third", "fourth", "fifth")

BIN_YAW = math.radians(20.0)
"""Largest rotation of the bin to either side."""

HALF_SIZES = {
    "cube": (object_sizes.CUBE_HALF, object_sizes.CUBE_HALF),
    "tape": (object_sizes.TAPE_RADIUS, object_sizes.TAPE_HALF),
}
"""Half the width of an item that lies on the table, and half its height, m."""

LINE_TURNS = (None, None, 0.0, math.pi / 2)
"""Direction, from a cube's yaw, of the line that stands for the cube; None for its square."""
YAW_DIGITS = 1e6
"""Digits of a yaw (rad) behind this one are as good as random."""

Bounds = tuple[int, int]
"""Fewest and most, both included."""


def draw_number(rng: np.random.Generator, bounds: Bounds) -> int:
    """Draw a whole number between two bounds, both included, uniformly."""
    low, high = bounds
    return int(rng.integers(low, high + 1))


def counted_goals(scene: Scene, kind: ObjectKind, most: int) -> tuple[Goal, ...]:
    """Return a goal for every object of a kind, by color, for once to `most` times.

    A red cube, at most twice -> *red once* and *red twice*, ``Goal.of(color="red", repeats=2)``.
    """
    return goals_by_color(scene, kind, "repeats", range(1, most + 1))


def goals_by_color(
    scene: Scene, kind: ObjectKind, slot: str, values: Iterable[SlotValue]
) -> tuple[Goal, ...]:
    """Return a goal for every object of a kind, by color, with each value of another slot.

    A slot is a named part of a goal. A red cube, slot ``"relation"``, values ``("before",
    "after")`` -> ``Goal.of(color="red", relation="before")`` and the same with ``"after"``.
    """
    goals: list[Goal] = []
    for item in scene.of_kind(kind):
        goals += [Goal.of(color=str(item.color), **{slot: value}) for value in values]
    return tuple(goals)


class ItemPlan(NamedTuple):
    """A cube or a roll of tape that is to be drawn.

    Attributes:
        name: ``cube_red``.
        color: of it.
        region: in which it lies.
        gap: to all that is there already, m.
        kind: ``cube`` or ``tape``.
    """

    name: str
    color: Color
    region: Region
    gap: float
    kind: Literal["cube", "tape"] = "cube"


class DiscPlan(NamedTuple):
    """A target disc that is to be drawn.

    Attributes:
        name: ``target``.
        region: in which it lies.
        radius: m.
        gap: to all that is there already, m.
        rgb: color of its rings, each part from 0 to 1; None for the usual one.
    """

    name: str
    region: Region
    radius: float
    gap: float = 0.0
    rgb: tuple[float, float, float] | None = None


class ButtonAndCubes(NamedTuple):
    """A button, cubes, and what keeps later objects away from both."""

    button: SceneObject
    cubes: tuple[SceneObject, ...]
    obstacles: tuple[Obstacle, ...]


def draw_button(rng: np.random.Generator, region: Region, name: str = "button") -> SceneObject:
    """Draw a button with its center in the region; it is placed first and needs no clearance."""
    x, y = region.draw(rng)
    return SceneObject(name, "button", Point(x, y, object_sizes.BUTTON_HEIGHT))


def button_keep_out(button: SceneObject) -> Rectangle:
    """Return the axis-aligned square around a button that stays free."""
    half = object_sizes.BUTTON_KEEP_OUT_HALF
    return Rectangle(button.position.x, button.position.y, half, half)


def footprint(item: SceneObject) -> Rectangle:
    """Return the square that a cube, container, bin, box or base of a button covers."""
    half = item.half_width
    return Rectangle(item.position.x, item.position.y, half, half, item.yaw)


def disc_area(disc: SceneObject, gap: float = 0.0) -> Circle:
    """Return the circle that a target disc, a site or a tape covers, and `gap` meters around it."""
    return Circle(disc.position.x, disc.position.y, disc.half_width + gap)


def cube_obstacle(cube: SceneObject) -> Rectangle | Line:
    """Return what keeps later objects away from a cube: its square, or a line instead.

    RoboMME fits a box to each cube and projects the box's first two axes; rounding decides which
    axes these are. For every other cube one of them is vertical, and only a line through the middle
    of two sides remains. Here the cube's yaw in whole millionths of a radian, modulo 4, chooses one
    of `LINE_TURNS`, two of which stand for the square.
    """
    turn = LINE_TURNS[int(cube.yaw * YAW_DIGITS) % len(LINE_TURNS)]
    if turn is None:
        return footprint(cube)
    x, y, _ = cube.position
    return Line(x, y, object_sizes.CUBE_HALF, cube.yaw + turn)


def draw_item(
    rng: np.random.Generator, plan: ItemPlan, obstacles: Sequence[Obstacle]
) -> SceneObject:
    """Draw a cube or a roll of tape as planned, with any yaw, away from all obstacles.

    Draws place and yaw, in this order, again until there is room. Raises SceneRejectedError after
    256 draws without any.
    """
    half_width, half_height = HALF_SIZES[plan.kind]

    def draw() -> SceneObject:
        x, y = plan.region.draw(rng, inset=half_width)
        yaw = 2.0 * math.pi * rng.random()
        return SceneObject(
            name=plan.name,
            kind=plan.kind,
            position=Point(x, y, half_height),
            yaw=yaw,
            color=plan.color,
        )

    def clearance(item: SceneObject) -> Footprint:
        if plan.kind == "tape":
            return disc_area(item, plan.gap)
        return footprint(item).grown(plan.gap)

    return placed(plan.name, draw, clearance, obstacles)


def draw_cubes(
    rng: np.random.Generator, plans: Iterable[ItemPlan], obstacles: Sequence[Obstacle]
) -> list[SceneObject]:
    """Draw the planned cubes one after the other, each away from those before it.

    Returns them in the order of `plans`. A plan is asked for after the draws of the one before.
    """
    taken = list(obstacles)
    drawn = []
    for plan in plans:
        cube = draw_item(rng, plan, taken)
        drawn.append(cube)
        taken.append(cube_obstacle(cube))
    return drawn


def draw_colored_cubes(
    rng: np.random.Generator,
    count: int,
    region: Region,
    gap: float,
    obstacles: Sequence[Obstacle],
) -> tuple[SceneObject, ...]:
    """Draw `count` cubes of different colors, ``cube_red`` and so on, in random order.

    They lie in the region, at least `gap` meters from each other and from all obstacles.
    """
    colors = shuffled(rng, COLORS)[:count]
    plans = [ItemPlan(f"cube_{color}", color, region, gap) for color in colors]
    return tuple(draw_cubes(rng, plans, obstacles))


def draw_button_and_cubes(
    rng: np.random.Generator,
    difficulty: Difficulty,
    region: Region,
    gap: float,
    button_region: Region = BUTTON_REGION,
) -> ButtonAndCubes:
    """Draw a button, then one cube or three of different colors around it.

    Args:
        rng: the button is drawn first.
        difficulty: decides the number of cubes.
        region: of the cubes.
        gap: between a cube and what was drawn before, m.
        button_region: of the button's center.
    """
    button = draw_button(rng, button_region)
    keep_out = button_keep_out(button)
    cubes = draw_colored_cubes(rng, CUBES[difficulty], region, gap, [keep_out])
    around_cubes = [cube_obstacle(cube) for cube in cubes]
    return ButtonAndCubes(button, cubes, (keep_out, *around_cubes))


def draw_target(
    rng: np.random.Generator, plan: DiscPlan, obstacles: Sequence[Obstacle]
) -> SceneObject:
    """Draw a target disc as planned, away from all obstacles.

    Draws again until there is room; raises SceneRejectedError after 256 draws without any.
    """

    def draw() -> SceneObject:
        x, y = plan.region.draw(rng, inset=plan.radius)
        return SceneObject(
            name=plan.name,
            kind="target",
            position=Point(x, y, object_sizes.TARGET_HEIGHT),
            radius=plan.radius,
            rgb=plan.rgb,
        )

    return placed(plan.name, draw, lambda target: disc_area(target, plan.gap), obstacles)


def draw_targets(
    rng: np.random.Generator, plans: Iterable[DiscPlan], obstacles: Sequence[Obstacle]
) -> list[SceneObject]:
    """Draw the planned target discs one after the other, each away from those before it.

    Returns them in the order of `plans`.
    """
    taken = list(obstacles)
    targets = []
    for plan in plans:
        target = draw_target(rng, plan, taken)
        targets.append(target)
        taken.append(disc_area(target))
    return targets


def marker_over(target: SceneObject) -> SceneObject:
    """Return the disc that lights up over a target: a little wider, and high enough to cover it.

    Over ``target_left`` it is ``marker_left``.
    """
    name = target.name.replace("target", "marker")
    x, y, z = target.position
    return SceneObject(
        name=name,
        kind="marker",
        position=Point(x, y, z - object_sizes.MARKER_DEPTH),
        radius=object_sizes.MARKER_RADIUS_SHARE * target.half_width,
    )


def draw_bin(
    rng: np.random.Generator, region: Region, obstacles: Sequence[Obstacle]
) -> SceneObject:
    """Draw a bin whose center is in the region and whose walls touch no obstacle.

    It is turned by at most `BIN_YAW` to either side. Draws again until there is room; see `placed`.
    """

    def draw() -> SceneObject:
        x, y = region.draw(rng)
        # Uniform, to either side.
        yaw = (2.0 * rng.random() - 1.0) * BIN_YAW
        return SceneObject(
            name="bin",
            kind="bin",
            position=Point(x, y, object_sizes.BIN_HEIGHT / 2),
            yaw=yaw,
        )

    return placed("bin", draw, footprint, obstacles)


def bin_keep_out(item: SceneObject) -> Rectangle:
    """Return the square that keeps cubes away from a bin; as in RoboMME, it does not turn."""
    half = object_sizes.BIN_HALF
    return Rectangle(item.position.x, item.position.y, half, half)


def placed(
    name: str,
    draw: Callable[[], SceneObject],
    clearance: Callable[[SceneObject], Footprint],
    obstacles: Sequence[Obstacle],
) -> SceneObject:
    """Draw candidates for an object until the area that one needs is free of obstacles.

    Args:
        name: of the object, for the error.
        draw: draws a candidate.
        clearance: returns the area that a candidate needs.
        obstacles: what is on the table.

    Raises:
        SceneRejectedError: no candidate had room.
    """
    item = place(draw, clearance, obstacles)
    if item is None:
        raise SceneRejectedError(f"no place for {name}")
    return item
