"""The things on a table that a hand can be sent to, by the pixels of their origins."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from typing import NamedTuple

import numpy as np
import sapien

from roboirg.core.episode import SceneObject
from roboirg.core.observations import PICTURE_SIZE
from roboirg.core.subgoal_text import Point
from roboirg.simulation.bodies import Body
from roboirg.simulation.rendering.viewpoint import FOCAL_LENGTH, to_front_camera
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
    """Return the objects of some kinds that are in the world now, with their pixels."""
    return tuple(
        Thing(body.item, origin_pixel(body))
        for name, body in world.bodies.items()
        if body.item.kind in kinds and name not in world.absent
    )


class NearThing(NamedTuple):
    """A thing, and how far its origin is from a point, pixels."""

    thing: Thing
    distance: float


def nearest_thing(things: Iterable[Thing], point: Point) -> NearThing | None:
    """Return the thing whose origin is nearest to a point; None if none is in the picture."""
    nearest: NearThing | None = None
    for thing in things:
        if thing.pixel is None:
            continue
        distance = math.dist(thing.pixel, point)
        if nearest is None or distance < nearest.distance:
            nearest = NearThing(thing, distance)
    return nearest


def held_thing(world: World) -> str | None:
    """Return the name of what is in the hand; None if it is empty."""
    for kind in _HELD:
        subjects = [fact.subject for fact in world.facts if fact.kind == kind]
        if subjects:
            return min(subjects)
    return None


def origin_pixel(body: Body) -> Point | None:
    """Return row and column of an object's origin in the front picture; None outside of it.

    It is a pinhole projection; an object that is hidden has a pixel, too.
    """
    frame = sapien.Pose(np.asarray(body.position))
    x, y, z = to_front_camera(frame)[:3, 3]  # m: right, down, forward
    if z <= 0:  # behind the camera
        return None
    row = round(PICTURE_SIZE / 2 + FOCAL_LENGTH * float(y / z))
    column = round(PICTURE_SIZE / 2 + FOCAL_LENGTH * float(x / z))
    if row not in range(PICTURE_SIZE) or column not in range(PICTURE_SIZE):
        return None
    return row, column
