"""What tests of the simulator do with a world: let it rest, let the expert work, find objects."""

import itertools

from roboirg.simulation.expert.primitives import MotionPrimitives
from roboirg.simulation.physics_settings import HOME_ACTION


def rest(world, steps):
    """Step while the robot stays at home, and return the world."""
    for _ in range(steps):
        world.step(HOME_ACTION)
    return world


def execute(world, primitive):
    """Let the expert execute a primitive."""
    pieces = MotionPrimitives(world).execute(primitive)
    for action in itertools.chain.from_iterable(pieces):
        world.step(action)


def seen_entity(body):
    """Return the part of a body that moves and is seen: of a button its cap, else all of it."""
    return body.entity if body.button is None else body.button.links[1].entity
