"""The things on a table that a hand can be sent to, by the pixels of their origins."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from typing import NamedTuple

import numpy as np
import sapien

from roboirg.core.episode import SceneObject
from roboirg.core.subgoal_text import Point
from roboirg.simulation.bodies import Body
from roboirg.simulation.rendering.viewpoint import FOCAL_LENGTH, SIZE, to_front_camera
from roboirg.simulation.world import World

_HELD = ("held", "picked", "lifted")
"""Facts about what is in the hand, the surest first."""


class Thing(NamedTuple):
    """An object as it stands now.

    Attributes:
        item: its data.
        pixel: row and column of its origin in the front picture, rounded; None outside of it.
    """

    item: SceneObject
    pixel: Point | None


def present_things(world: World, kinds: Collection[str]) -> tuple[Thing, ...]:
    """Return the objects of some kinds that are in the world now."""
    return tuple(
        Thing(body.item, origin_pixel(body))
        for name, body in world.bodies.items()
        if body.item.kind in kinds and name not in world.absent
    )


def nearest_thing(things: Iterable[Thing], point: Point) -> tuple[Thing, float] | None:
    """Return the thing whose origin is nearest to a point, and how many pixels; None of none."""
    measured = [(math.dist(one.pixel, point), one) for one in things if one.pixel is not None]
    if not measured:
        return None
    distance, thing = min(measured, key=lambda one: one[0])
    return thing, distance


def held_thing(world: World) -> str | None:
    """Return the name of what is in the hand; None if it is empty."""
    facts = sorted(world.facts)
    return next((fact.subject for kind in _HELD for fact in facts if fact.kind == kind), None)


def origin_pixel(body: Body) -> Point | None:
    """Return row and column of an object's origin in the front picture; None outside of it."""
    frame = sapien.Pose(np.asarray(body.position))
    x, y, z = to_front_camera(frame)[:3, 3]
    if z <= 0:
        return None
    row, column = (round(SIZE / 2 + FOCAL_LENGTH * float(one / z)) for one in (y, x))
    return (row, column) if 0 <= row < SIZE and 0 <= column < SIZE else None
