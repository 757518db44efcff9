"""Boxes and rolls of tape in the simulator: sizes, masses, holes, and what comes of using them.

A roll of tape is 35 mm high and 55 mm wide, with a hole of 30 mm; a box is 130 mm wide.
"""

import itertools

import numpy as np
import pytest
from moved_worlds import execute, rest

import roboirg
from roboirg.core.conditions import Fact
from roboirg.core.episode import Primitive, Scene, SceneObject
from roboirg.core.motions import Point
from roboirg.policies import make_policy, play
from roboirg.simulation.expert.primitives import MotionPrimitives
from roboirg.simulation.world import World
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim

TAPE_ROLL = SceneObject("tape", "tape", Point(0.0, 0.0, 0.0175), 0.0, "yellow")
GREEN_BOX = SceneObject("box_green", "box", Point(0.0, 0.0, 0.02), 0.2, "green")


def world_with_tape():
    """Return a world without cameras in which a roll of tape lies in the middle of the table."""
    return World(Scene((TAPE_ROLL,)), visible=False)


def step_through(world, pieces, gripper=None):
    """Execute pieces of a motion, perhaps with another gripper action: -1 closes, 1 opens."""
    for action in itertools.chain.from_iterable(pieces):
        if gripper is not None:
            action[-1] = gripper
        world.step(action)


def world_after_drop(x, y, z):
    """Return a world with a box, after a tape has fallen from a point, m, and come to rest."""
    tape = SceneObject("tape", "tape", Point(x, y, z), 0.7, "yellow")
    return rest(World(Scene((GREEN_BOX, tape)), visible=False), 40)


def test_a_roll_of_tape_weighs_50_to_100_grams():
    """As ordinary ones do; the mass is in kilograms."""
    tape = world_with_tape().bodies["tape"]

    assert 0.05 <= tape.physics.mass <= 0.1


def test_a_roll_of_tape_can_be_gripped_around_its_outside():
    """The roll is 55 mm wide, and the open fingers 80 mm apart."""
    world = world_with_tape()

    execute(world, Primitive("pick_cube", "tape"))

    assert Fact("picked", "tape") in world.facts
    assert Fact("held", "tape") in world.facts


def move_to(world, height, gripper):
    """Move the tool to a height, m, over the middle of the tape's wall, with the fingers down.

    They close along y, across the wall. The gripper's action, -1 (closed) to 1 (open), is held on
    the way, and until the fingers are there.
    """
    expert = MotionPrimitives(world)
    middle_of_the_wall = Point(0.0, 0.02125, height)
    way = expert._move(middle_of_the_wall, expert._rotation())
    step_through(world, [way], gripper)
    step_through(world, [expert._grip(gripper)], gripper)


def test_a_roll_of_tape_can_be_gripped_by_its_wall():
    """A roll is 35 mm high; its wall is 12.5 mm thick, and the middle of that is 21.25 mm from the
    axis. At a gripper action of -0.1 each finger is 12.5 mm from the middle, so one fits into the
    hole and the other outside. Closed, they are the wall's thickness apart, and lift the roll."""
    world = world_with_tape()

    move_to(world, height=0.15, gripper=-0.1)
    move_to(world, height=0.0175, gripper=-0.1)
    tape_before_the_grasp = world.bodies["tape"].position
    step_through(world, [MotionPrimitives(world)._grip(-1.0)])
    gripped_width = world.robot.finger_positions.sum()
    move_to(world, height=0.15, gripper=-1.0)

    assert tape_before_the_grasp == pytest.approx((0.0, 0.0, 0.0175), abs=2e-3)
    assert gripped_width == pytest.approx(0.0125, abs=3e-3)
    assert Fact("picked", "tape") in world.facts


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (-0.02, 0.03)])
def test_tape_that_falls_between_the_walls_of_a_box_is_in_the_box(x, y):
    """From 12 cm above the table. The box's floor is 2 mm high, and one that has touched a wall
    may stand on its edge, so the tape's center may be 19.5 to 29.5 mm high."""
    world = world_after_drop(x, y, z=0.12)

    assert 0.0185 <= world.bodies["tape"].position.z <= 0.0305
    assert Fact("binned", "tape", "box_green") in world.facts


def test_a_box_is_not_moved_by_what_falls_into_it():
    """A roll of tape falls from 12 cm and touches a wall of the box, which stays at its place."""
    world = world_after_drop(-0.02, 0.03, z=0.12)

    assert world.bodies["box_green"].position == pytest.approx((0.0, 0.0, 0.02))


def test_tape_next_to_a_box_is_not_in_it():
    """The box is 130 mm wide, with its middle at y = 0, and the tape lies 110 mm from it."""
    world = world_after_drop(0.0, 0.11, z=0.02)

    assert Fact("lying", "tape") in world.facts
    assert Fact("binned", "tape", "box_green") not in world.facts


def test_tape_held_over_a_box_is_not_in_it_until_it_is_dropped():
    """The first two pieces of the motion carry it over the box."""
    world = World(get_episode("PutInBox", "test", 0).scene, visible=False)
    expert = MotionPrimitives(world)
    in_box = Fact("binned", "tape", "box_green")
    step_through(world, expert.execute(Primitive("pick_cube", "tape")))
    pieces = expert.execute(Primitive("put_into", "tape", "box_green"))

    step_through(world, itertools.islice(pieces, 2))
    assert in_box not in world.facts

    step_through(world, pieces)
    assert in_box in world.facts


def names_of_pressing_bodies(world):
    """Return the names of all bodies that press on another one at this step."""
    names = set()
    for contact in world._physics.get_contacts():
        if any(np.any(point.impulse) for point in contact.points):
            names.update(body.entity.name for body in contact.bodies)
    return names


def test_the_oracle_drops_tape_into_a_box_without_touching_a_box():
    """Contacts are noted at every control step: the fingers press on the tape, which had lain on
    the table, and nothing presses on the green box, its goal, or on the purple one. In this episode
    the hand would touch the box if the tape were let go 6 cm high."""
    env = roboirg.make("PutInBox", split="train", episode=11, cameras=())
    pressing = set()

    def note_contacts(env, _demonstration):
        pressing.update(names_of_pressing_bodies(env.session.world))

    env.set_frame_hook(note_contacts)
    played = play(env, make_policy("oracle", 0))

    assert played["status"] == "success"
    assert pressing == {"table", "tape", "panda_leftfinger", "panda_rightfinger"}


def test_the_front_camera_sees_the_target_through_the_hole_of_a_roll_of_tape():
    """In the middle column of the tape's pixels, between its first and its last one."""
    disc = SceneObject("target", "target", Point(0.0, 0.0, 0.005), radius=0.05)
    world = rest(World(Scene((disc, TAPE_ROLL))), 2)
    tape = world.bodies["tape"].entity.per_scene_id
    target = world.bodies["target"].entity.per_scene_id

    seen = world.cameras.segmentation("front")

    _, columns = np.nonzero(seen == tape)
    column = seen[:, (columns.min() + columns.max()) // 2]
    first, *_, last = np.flatnonzero(column == tape)
    assert target in column[first:last]
