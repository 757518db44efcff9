"""Boxes and rolls of tape in the simulator: sizes, masses, holes, and what comes of using them."""

import itertools

import numpy as np
import pytest
from moved_worlds import execute, rest

import roboirg
from roboirg.core import object_sizes
from roboirg.core.conditions import Fact
from roboirg.core.episode import Primitive, Scene, SceneObject
from roboirg.core.motions import Point
from roboirg.policies import make_policy, play
from roboirg.simulation import physics_settings
from roboirg.simulation.expert.primitives import MotionPrimitives
from roboirg.simulation.world import World
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim

TAPE_ROLL = SceneObject("tape", "tape", Point(0.0, 0.0, object_sizes.TAPE_HALF), 0.0, "yellow")
GREEN_BOX = SceneObject(
    "box_green", "box", Point(0.0, 0.0, object_sizes.BOX_HEIGHT / 2), 0.2, "green"
)
HALF_OPEN = -0.1
"""A gripper action at which each finger is 0.0125 from the middle: one fits into the hole."""


def step_through(world, pieces, gripper=None):
    for action in itertools.chain.from_iterable(pieces):
        if gripper is not None:
            action[-1] = gripper
        world.step(action)


def world_after_drop(x, y, height, box=GREEN_BOX):
    """The world after a tape has fallen from a height and come to rest."""
    tape = SceneObject("tape", "tape", Point(x, y, height), 0.7, "yellow")
    return rest(World(Scene((box, tape)), visible=False), 40)


def test_a_roll_of_tape_weighs_50_to_100_grams_and_lies_still():
    world = rest(World(Scene((TAPE_ROLL,)), visible=False), 40)
    body = world.bodies["tape"]

    assert 0.05 <= body.physics.mass <= 0.1
    assert body.position == pytest.approx(TAPE_ROLL.position, abs=1e-4)
    assert Fact("lying", "tape") in world.facts


def test_a_roll_of_tape_can_be_gripped_around_its_outside():
    world = World(Scene((TAPE_ROLL,)), visible=False)
    execute(world, Primitive("pick_cube", "tape"))

    assert Fact("picked", "tape") in world.facts
    assert Fact("held", "tape") in world.facts


def test_a_roll_of_tape_can_be_gripped_by_its_wall():
    """A finger fits into the hole; the wall is what is held then."""
    world = World(Scene((TAPE_ROLL,)), visible=False)
    expert = MotionPrimitives(world)
    rotation = expert._rotation()  # closes along y
    middle = (object_sizes.TAPE_RADIUS + object_sizes.TAPE_HOLE_RADIUS) / 2
    above, at = (Point(0.0, middle, z) for z in (0.15, object_sizes.TAPE_HALF))
    step_through(world, [expert._move(above, rotation)], HALF_OPEN)
    step_through(world, [expert._grip(physics_settings.OPEN)], HALF_OPEN)
    step_through(world, [expert._move(at, rotation)], HALF_OPEN)

    assert world.bodies["tape"].position == pytest.approx(TAPE_ROLL.position, abs=2e-3)

    step_through(world, [expert._grip(physics_settings.CLOSED)])
    wall = object_sizes.TAPE_RADIUS - object_sizes.TAPE_HOLE_RADIUS
    assert world.robot.finger_positions.sum() == pytest.approx(wall, abs=3e-3)

    step_through(world, [expert._move(above, rotation)])
    assert Fact("picked", "tape") in world.facts


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (-0.02, 0.03)])
def test_tape_that_falls_between_the_walls_of_a_box_is_in_the_box(x, y):
    """(x, y) is from where it falls, relative to the middle of the box, in meters."""
    world = world_after_drop(x, y, 0.12)
    # One that has touched a wall may stand on its edge.
    low, high = (
        object_sizes.BOX_FLOOR + size for size in (object_sizes.TAPE_HALF, object_sizes.TAPE_RADIUS)
    )

    assert low - 1e-3 <= world.bodies["tape"].position.z <= high + 1e-3
    assert Fact("binned", "tape", "box_green") in world.facts
    assert world.bodies["box_green"].position == pytest.approx(GREEN_BOX.position)


def test_tape_next_to_a_box_is_not_in_it():
    world = world_after_drop(0.0, 0.11, 0.02)
    assert Fact("lying", "tape") in world.facts
    assert Fact("binned", "tape", "box_green") not in world.facts


def test_tape_held_over_a_box_is_not_in_it_until_it_is_dropped():
    """The first two pieces of the motion carry it over the box."""
    episode = get_episode("PutInBox", "test", 0)
    world = World(episode.scene, visible=False)
    expert = MotionPrimitives(world)
    box = f"box_{episode.goal.text('color')}"
    step_through(world, expert.execute(Primitive("pick_cube", "tape")))
    into = expert.execute(Primitive("put_into", "tape", box))
    inside = Fact("binned", "tape", box)
    step_through(world, itertools.islice(into, 2))

    assert inside not in world.facts

    step_through(world, into)
    assert inside in world.facts


def test_putting_tape_into_a_box_makes_no_other_contact_with_the_box():
    episode = get_episode("PutInBox", "train", 11)  # where 0.06 would be too high
    env = roboirg.make(episode, cameras=())
    touched = set()

    def look(env, _demonstration):
        world = env.session.world
        for contact in world._physics.get_contacts():
            names = {body.entity.name for body in contact.bodies}
            forces = [np.linalg.norm(point.impulse) for point in contact.points]
            if any(forces) and any(name.startswith("box") for name in names):
                touched.update(names)

    env.set_frame_hook(look)

    assert play(env, make_policy("oracle", 0))["status"] == "success"
    assert touched <= {"tape", f"box_{episode.goal.text('color')}"}


def test_the_front_camera_sees_the_target_through_the_hole_of_a_roll_of_tape():
    disc = SceneObject("target", "target", Point(0.0, 0.0, 0.005), radius=0.05)
    world = rest(World(Scene((disc, TAPE_ROLL))), 2)

    seen = world.cameras.segmentation("front")

    tape, target = (world.bodies[name].entity.per_scene_id for name in ("tape", "target"))
    rows, columns = np.nonzero(seen == tape)
    inside = seen[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    middle = inside[:, inside.shape[1] // 2]
    first, *_, last = np.flatnonzero(middle == tape)
    assert target in middle[first:last]
