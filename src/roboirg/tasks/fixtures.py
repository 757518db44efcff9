"""Things that several tasks place in the same way: the button, cubes, a target disc."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from roboirg.episode import Colour, Point, SceneObject
from roboirg.errors import SceneRejectedError
from roboirg.tasks import geometry
from roboirg.tasks.placement import Circle, Footprint, Rectangle, Region, place

ORDINALS = ("first", "second", "third", "fourth", "fifth")


def draw_button(rng: np.random.Generator, region: Region) -> SceneObject:
    """A button anywhere in the region; it is placed first and needs no clearance."""
    x, y = region.draw(rng)
    return SceneObject("button", "button", Point(x, y, geometry.BUTTON_HEIGHT))


def button_keep_out(button: SceneObject) -> Rectangle:
    """The axis-aligned square around a button that stays free."""
    half = geometry.BUTTON_KEEP_OUT_HALF
    return Rectangle(button.position.x, button.position.y, half, half)


def cube_footprint(cube: SceneObject) -> Rectangle:
    """The square that a cube covers."""
    half = geometry.CUBE_HALF
    return Rectangle(cube.position.x, cube.position.y, half, half, cube.yaw)


def draw_cube(
    rng: np.random.Generator,
    name: str,
    colour: Colour,
    region: Region,
    gap: float,
    obstacles: Sequence[Footprint],
) -> SceneObject:
    """A cube with any yaw, at least `gap` metres from all obstacles.

    Raises:
        SceneRejectedError: no free place was found.
    """

    def draw() -> SceneObject:
        x, y = region.draw(rng, inset=geometry.CUBE_HALF)
        yaw = 2.0 * math.pi * rng.random()
        return SceneObject(name, "cube", Point(x, y, geometry.CUBE_HALF), yaw, colour)

    return _placed(name, draw, lambda cube: cube_footprint(cube).grown(gap), obstacles)


def draw_target(
    rng: np.random.Generator,
    name: str,
    radius: float,
    region: Region,
    gap: float,
    obstacles: Sequence[Footprint],
) -> SceneObject:
    """A target disc of `radius` metres, at least `gap` metres from all obstacles.

    Raises:
        SceneRejectedError: no free place was found.
    """

    def draw() -> SceneObject:
        x, y = region.draw(rng, inset=radius)
        return SceneObject(name, "target", Point(x, y, geometry.TARGET_HEIGHT), radius=radius)

    def clearance(target: SceneObject) -> Circle:
        return Circle(target.position.x, target.position.y, radius + gap)

    return _placed(name, draw, clearance, obstacles)


def _placed(
    name: str,
    draw: Callable[[], SceneObject],
    clearance: Callable[[SceneObject], Footprint],
    obstacles: Sequence[Footprint],
) -> SceneObject:
    item = place(draw, clearance, obstacles)
    if item is None:
        raise SceneRejectedError(f"no place for {name}")
    return item
