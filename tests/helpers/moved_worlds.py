"""What tests of the simulator do with a world: let it rest, and let the expert work."""

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
