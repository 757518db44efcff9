"""Scripted motions: positions of objects at each step, independent of the robot."""

import math

import numpy as np
import pytest
from moved_worlds import rest

from roboirg.core.conditions import Fact
from roboirg.core.episode import Scene, SceneObject
from roboirg.core.motions import Away, Glow, Point, Shuttle, Swap, Vanish
from roboirg.simulation import physics_settings
from roboirg.simulation.motion_player import shuttle_position
from roboirg.simulation.world import World

pytestmark = pytest.mark.sim


def cube(name, x, y, z=0.02, yaw=0.0):
    return SceneObject(name, "cube", Point(x, y, z), yaw, "red")


def world_with(objects, *motions):
    """Return a world without cameras in which objects move by themselves."""
    return World(Scene(tuple(objects), motions), visible=False)


def place(world, name):
    """Return where on the table an object is now, (x, y) in m."""
    return world.bodies[name].position[:2]


def places(world):
    """Return where on the table each object is now, (x, y) in m, to a tenth of a millimeter."""
    return {name: tuple(np.round(place(world, name), 4).tolist()) for name in world.bodies}


def yaw_of(world, name):
    w, _, _, z = world.bodies[name].entity.pose.q
    return 2 * math.atan2(z, w)


def swapping_world():
    """a and b change places from step 10 on, in 50 steps, on lanes 0.07 m aside; c stays."""
    objects = [cube("a", 0.0, -0.1, yaw=0.0), cube("b", 0.0, 0.1, yaw=0.3), cube("c", 0.1, 0.15)]
    return world_with(objects, Swap("a", "b", 10, 50, 0.07, ("c",)))


def test_objects_stay_where_they_are_before_their_swap_begins():
    """Two objects, a and b, stand at y = -0.1 m and 0.1 m, and change places from step 10 on; c
    stays. After ten steps they have not moved."""
    world = rest(swapping_world(), 10)

    assert places(world) == {"a": (0.0, -0.1), "b": (0.0, 0.1), "c": (0.1, 0.15)}


def test_half_way_through_a_swap_the_objects_pass_each_other_on_opposite_lanes():
    """a goes from y = -0.1 m towards +y, so its left is -x; b comes the other way, on its own left.
    Both lanes are 0.07 m aside. a also turns by 0.3 rad, of which half is done."""
    world = rest(swapping_world(), 36)

    assert place(world, "a") == pytest.approx((-0.07, 0.0), abs=2e-3)
    assert place(world, "b") == pytest.approx((0.07, 0.0), abs=2e-3)
    assert yaw_of(world, "a") == pytest.approx(0.15, abs=1e-2)


@pytest.mark.parametrize("step", [61, 66])
def test_after_a_swap_two_objects_have_changed_places_and_yaw_and_the_others_stay(step):
    """a stood at y = -0.1 m with a yaw of 0, and b at 0.1 m with 0.3 rad; they swapped from step 10
    to 60. c was never moved. It stays so, one step and six steps later."""
    world = rest(swapping_world(), step)

    assert places(world) == {"a": (0.0, 0.1), "b": (0.0, -0.1), "c": (0.1, 0.15)}
    assert yaw_of(world, "a") == pytest.approx(0.3, abs=1e-3)


def test_two_swaps_in_a_row_start_with_the_stage_they_wait_for():
    """Both swaps count their steps from the start of stage 2, which is noted after 20 steps: until
    then nothing moves. Then a and b change places in 50 steps, and a and c in the next 50."""
    objects = [cube("a", 0.0, -0.15), cube("b", 0.0, 0.0), cube("c", 0.0, 0.15)]
    first = Swap("a", "b", 0, 50, 0.07, ("c",), stage=2)
    second = Swap("a", "c", 50, 50, 0.07, ("b",), stage=2)

    world = rest(world_with(objects, first, second), 20)
    before = places(world)
    world.note_stage(2)
    rest(world, 101)

    assert before == {"a": (0.0, -0.15), "b": (0.0, 0.0), "c": (0.0, 0.15)}
    assert places(world) == {"a": (0.0, 0.15), "b": (0.0, -0.15), "c": (0.0, 0.0)}


def test_an_object_that_is_away_is_parked_far_off_and_returns_to_its_place():
    """Far off is at x > 5 m, where it does not count as lying on the table."""
    world = world_with([cube("a", 0.0, -0.1)], Away("a", 0, 5))

    rest(world, 5)
    assert place(world, "a")[0] > 5
    assert Fact("lying", "a") not in world.facts

    rest(world, 1)
    assert place(world, "a") == pytest.approx((0.0, -0.1), abs=1e-4)
    assert Fact("lying", "a") in world.facts


def test_an_object_that_was_away_may_return_to_where_another_one_has_gone():
    """In steps 0 to 6, cube b takes the place of c, at (0.1, 0). Cube a is away in steps 8 to 12
    and returns under b, wherever that is: to (0.1, 0), and not to b's first place, 0.14 m from it.
    Both are there at once and push each other apart, so a is up to 0.03 m off."""
    a = cube("a", 0.0, -0.1)
    b = cube("b", 0.0, 0.1)
    c = cube("c", 0.1, 0.0)
    swap = Swap("b", "c", start=0, steps=6, lane=0.0)
    away = Away("a", 8, 12, under="b")

    world = rest(world_with([a, b, c], swap, away), 13)

    assert place(world, "a") == pytest.approx((0.1, 0.0), abs=0.03)


PRESSED = Fact("pressed", "button")
TO_AND_FRO = Shuttle("s", Point(0, -0.3, 0.01), Point(0, 0.3, 0.01), 60, 5, PRESSED)
"""From y = -0.3 m to 0.3 m in 60 steps, and back; five passes, until the button is pressed."""


@pytest.mark.parametrize(
    ("step", "y"),
    [(0, -0.3), (30, 0.0), (60, 0.3), (90, 0.0), (120, -0.3), (300, 0.3), (1000, 0.3)],
)
def test_a_shuttle_runs_to_and_fro_and_stays_where_its_last_pass_ends(step, y):
    """It goes from y = -0.3 m to 0.3 m in 60 steps, and back. The fifth and last pass ends at step
    300, at 0.3 m."""
    assert shuttle_position(TO_AND_FRO, step).y == pytest.approx(y)


def test_a_shuttle_is_fastest_in_the_middle_of_its_way():
    """Step 30 is the middle of a pass of 60 steps. RoboMME's shuttle goes by 0.0150 m a step
    there."""
    y = [shuttle_position(TO_AND_FRO, step).y for step in (30, 31)]

    assert y[1] - y[0] == pytest.approx(0.015, rel=1e-2)


def shuttle_world():
    """A world with a shuttle that a button stops, and a target in the middle of its way."""
    button = SceneObject("button", "button", Point(-0.06, 0.0, 0.0075))
    target = SceneObject("target", "target", Point(0.0, 0.0, 0.01), radius=0.036, thickness=0.01)
    shuttle = SceneObject("s", "shuttle", TO_AND_FRO.begin, rgb=(0.2, 0.7, 0.4))
    return world_with([button, target, shuttle], TO_AND_FRO)


def test_a_world_shows_a_shuttle_s_position_one_step_late():
    """The shuttle follows a known course, from y = -0.3 m on. After 20 steps the world has it where
    that course is at step 19."""
    world = shuttle_world()

    rest(world, 20)

    expected = shuttle_position(TO_AND_FRO, 19).y
    assert world.bodies["s"].position.y == pytest.approx(expected, abs=1e-6)


def test_a_shuttle_counts_as_near_from_three_steps_before_the_target_s_middle():
    """The world shows it at the middle of its way, and of the target, at step 31."""
    world = shuttle_world()
    near = []

    for step in range(1, 34):
        if Fact("near", "s", "target") in world.step(physics_settings.HOME_ACTION):
            near.append(step)

    assert near == [27, 28, 29, 30, 31, 32, 33]


def push_button(world, depth_m):
    """Move the button so far down, and let its spring keep it there."""
    button = world.bodies["button"].button
    (joint,) = button.active_joints
    button.set_qpos(np.array([-depth_m]))
    joint.set_drive_target(-depth_m)


STOPPED_OVER_TARGET = Fact("stopped", "s", "target")


def test_a_pressed_button_stops_a_shuttle_at_the_next_step():
    """A shuttle runs over a target, whose middle it reaches at step 31. At step 33 the button that
    stops it is pushed down by 12 mm: after a step it counts as pressed, and a step later, as facts
    are those of the step before, the shuttle as stopped over the target."""
    world = rest(shuttle_world(), 33)

    push_button(world, depth_m=0.012)
    facts_after_a_step = rest(world, 1).facts
    facts_after_two_steps = rest(world, 1).facts

    assert PRESSED in facts_after_a_step
    assert STOPPED_OVER_TARGET not in facts_after_a_step
    assert STOPPED_OVER_TARGET in facts_after_two_steps


def test_a_shuttle_that_was_stopped_stays_when_the_button_is_up_again():
    """A shuttle was stopped over its target by a press of the button. The button is then let go,
    and 30 steps later no longer counts as pressed; the shuttle has not moved on."""
    world = rest(shuttle_world(), 33)
    push_button(world, depth_m=0.012)
    where_it_stopped = rest(world, 2).bodies["s"].position

    push_button(world, depth_m=0.0)
    rest(world, 30)

    assert PRESSED not in world.facts
    assert STOPPED_OVER_TARGET in world.facts
    assert world.bodies["s"].position == where_it_stopped


def world_with_a_light():
    """A cube in the air falls onto a target, whose light lingers for 20 steps after it has left."""
    falling = cube("a", 0.0, 0.0, z=0.1)
    target = SceneObject("target", "target", Point(0.0, 0.0, 0.005), radius=0.04)
    light = SceneObject("light", "marker", Point(0.0, 0.0, -0.005), radius=0.0401)
    return world_with([falling, target, light], Glow("light", Fact("over", "a", "target"), 20))


def test_a_light_is_in_its_place_a_step_after_something_was_over_its_target():
    """A cube in the air is over the target, whose light is a disc just below the table until it
    glows. At the second step the light is at its place, z = -0.005 m, and not parked far away."""
    world = rest(world_with_a_light(), 2)

    assert world.bodies["light"].position == pytest.approx((0.0, 0.0, -0.005))


def test_a_light_lingers_and_is_then_parked_far_off():
    """A cube is over a target, whose light is on: a disc at z = -0.005 m. The cube is then put 0.28
    m away. The light lingers for 20 steps, of which it learns one step late, so it is still there
    after 21 steps, and after 22 it is parked at x > 5 m, out of sight."""
    world = rest(world_with_a_light(), 2)
    light = world.bodies["light"]

    world.bodies["a"].put(Point(0.2, 0.2, 0.02))
    rest(world, 21)
    lingering = light.position
    rest(world, 1)

    assert lingering == pytest.approx((0.0, 0.0, -0.005))
    assert light.position.x > 5


def test_a_cube_that_falls_into_the_bin_is_gone_and_stays_counted():
    """The cube falls in within 20 of the 30 steps. What has vanished is parked at x > 5 m, 10 m
    high; the fact that it is in the bin lasts, and it lies nowhere."""
    binned = Fact("binned", "a", "bin")
    tray = SceneObject("bin", "bin", Point(0.1, 0.0, 0.025), yaw=0.2)
    world = world_with([tray, cube("a", 0.1, 0.0, z=0.15)], Vanish("a", binned))

    rest(world, 30)

    x, _, z = world.bodies["a"].position
    assert x > 5
    assert z == pytest.approx(10.0, abs=0.02)
    assert binned in world.facts
    assert Fact("lying", "a") not in world.facts
