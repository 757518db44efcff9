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


def cube(name: str, x: float, y: float, z: float = 0.02, yaw: float = 0.0) -> SceneObject:
    return SceneObject(name, "cube", Point(x, y, z), yaw, "red")


def place_in_plane(world: World, name: str) -> tuple[float, float]:
    return world.bodies[name].position[:2]


def turn(world: World, name: str) -> float:
    w, _, _, z = world.bodies[name].entity.pose.q
    return 2 * math.atan2(z, w)


def test_two_objects_change_places_on_opposite_lanes_and_the_others_stay():
    """Swap(a, b, from step 10, 50 steps, lane 0.07 m
    aside, c stays). Places are (x, y) in meters."""
    places = {"a": (0.0, -0.1), "b": (0.0, 0.1), "c": (0.1, 0.15)}
    objects = tuple(cube(name, *xy, yaw=0.3 * i) for i, (name, xy) in enumerate(places.items()))
    world = World(Scene(objects, (Swap("a", "b", 10, 50, 0.07, ("c",)),)), visible=False)
    rest(world, 10)

    assert place_in_plane(world, "a") == pytest.approx(places["a"], abs=1e-4)

    rest(world, 26)  # the step with k = 35 is half way
    # a goes towards +y, so its left is -x; b comes the other way on its own left.
    assert place_in_plane(world, "a") == pytest.approx((-0.07, 0.0), abs=2e-3)
    assert place_in_plane(world, "b") == pytest.approx((0.07, 0.0), abs=2e-3)
    assert turn(world, "a") == pytest.approx(0.15, abs=1e-2)

    rest(world, 25)
    assert place_in_plane(world, "a") == pytest.approx(places["b"], abs=1e-4)
    assert place_in_plane(world, "b") == pytest.approx(places["a"], abs=1e-4)
    assert place_in_plane(world, "c") == pytest.approx(places["c"], abs=1e-4)
    assert turn(world, "a") == pytest.approx(0.3, abs=1e-3)

    rest(world, 5)
    assert place_in_plane(world, "a") == pytest.approx(places["b"], abs=1e-4)


def test_two_swaps_in_a_row_start_with_the_stage_they_wait_for():
    """First a and b, then a and c; both count their steps from the start of stage 2."""
    places = {"a": (0.0, -0.15), "b": (0.0, 0.0), "c": (0.0, 0.15)}
    objects = tuple(cube(name, *xy) for name, xy in places.items())
    swaps = (
        Swap("a", "b", 0, 50, 0.07, ("c",), stage=2),
        Swap("a", "c", 50, 50, 0.07, ("b",), stage=2),
    )
    world = World(Scene(objects, swaps), visible=False)
    rest(world, 20)

    assert place_in_plane(world, "a") == pytest.approx(places["a"], abs=1e-4)

    world.note_stage(2)
    rest(world, 101)
    assert place_in_plane(world, "a") == pytest.approx(places["c"], abs=1e-4)
    assert place_in_plane(world, "b") == pytest.approx(places["a"], abs=1e-4)
    assert place_in_plane(world, "c") == pytest.approx(places["b"], abs=1e-4)


def test_an_object_that_is_away_returns_to_its_place_or_to_another_object():
    """a is away (parked at x > 5 m) from step 0 to 5, and from 8 to 12; then it is put under b."""
    objects = (cube("a", 0.0, -0.1), cube("b", 0.0, 0.1), cube("c", 0.1, 0.0))
    motions = (Away("a", 0, 5), Swap("b", "c", 0, 6, 0.0), Away("a", 8, 12, under="b"))
    world = World(Scene(objects, motions), visible=False)
    assert Fact("lying", "a") not in world.facts

    rest(world, 5)
    assert place_in_plane(world, "a")[0] > 5
    assert Fact("lying", "a") not in world.facts

    rest(world, 1)
    assert place_in_plane(world, "a") == pytest.approx((0.0, -0.1), abs=1e-4)
    assert Fact("lying", "a") in world.facts

    rest(world, 4)
    assert place_in_plane(world, "a")[0] > 5

    rest(world, 3)
    # Where b is now, with its own height: they push each other apart afterwards.
    assert place_in_plane(world, "a") == pytest.approx((0.1, 0.0), abs=0.03)


PRESSED = Fact("pressed", "button")
TO_AND_FRO = Shuttle("s", Point(0, -0.3, 0.01), Point(0, 0.3, 0.01), 60, 5, PRESSED)


def test_a_shuttle_runs_to_and_fro():
    """From y = -0.3 to 0.3 in 60 steps, and back; five passes, so it ends at 0.3."""
    places = [shuttle_position(TO_AND_FRO, step) for step in range(121)]

    assert places[0] == places[120] == TO_AND_FRO.begin
    assert places[30].y == pytest.approx(0.0)
    assert places[60] == TO_AND_FRO.end
    assert places[90].y == pytest.approx(0.0)
    assert shuttle_position(TO_AND_FRO, 300) == shuttle_position(TO_AND_FRO, 1000) == TO_AND_FRO.end
    # Peak speed, from the facts: 0.0150 m a step for 60 steps a pass.
    assert places[31].y - places[30].y == pytest.approx(0.015, 1e-2)


def shuttle_world():
    """A world with a shuttle that a button stops, and a target in the middle of its way."""
    objects = (
        SceneObject("button", "button", Point(-0.06, 0.0, 0.0075)),
        SceneObject("target", "target", Point(0.0, 0.0, 0.01), radius=0.036, thickness=0.01),
        SceneObject("s", "shuttle", TO_AND_FRO.begin, rgb=(0.2, 0.7, 0.4)),
    )
    return World(Scene(objects, (TO_AND_FRO,)), visible=False)


def test_a_shuttle_counts_as_near_from_three_steps_before_the_target_s_middle():
    """It is at the middle of its way, and of the target, 30 steps after its start."""
    world = shuttle_world()
    near = []
    for step in range(1, 34):
        if Fact("near", "s", "target") in world.step(physics_settings.HOME_ACTION):
            near.append(step)
        # The step that ends at t shows position t - 1.
        expected = shuttle_position(TO_AND_FRO, world.elapsed - 1).y
        assert world.bodies["s"].position.y == pytest.approx(expected, abs=1e-6)

    assert near == [*range(27, 34)]


def test_a_pressed_button_stops_a_shuttle_for_good():
    """At step 33 the shuttle is over its target; the button goes down by 12 mm, and up again."""
    world = shuttle_world()
    stopped = Fact("stopped", "s", "target")
    rest(world, 33)
    button = world.bodies["button"].button
    (joint,) = button.active_joints

    button.set_qpos(np.array([-0.012]))
    joint.set_drive_target(-0.012)
    world.step(physics_settings.HOME_ACTION)
    assert PRESSED in world.facts
    assert stopped not in world.facts
    rest(world, 1)
    assert stopped in world.facts

    where = world.bodies["s"].position
    joint.set_drive_target(0.0)
    rest(world, 30)
    assert PRESSED not in world.facts
    assert world.bodies["s"].position == where
    assert stopped in world.facts


def test_a_light_glows_while_something_is_over_its_target_and_lingers():
    """It lingers for 20 steps; a light that is off is parked at x > 5 m."""
    over = Fact("over", "a", "target")
    objects = (
        cube("a", 0.0, 0.0, z=0.1),
        SceneObject("target", "target", Point(0.0, 0.0, 0.005), radius=0.04),
        SceneObject("light", "marker", Point(0.0, 0.0, -0.005), radius=0.0401),
    )
    world = World(Scene(objects, (Glow("light", over, 20),)), visible=False)
    light = world.bodies["light"]
    falling = world.bodies["a"]
    rest(world, 1)

    assert over in world.facts

    rest(world, 1)
    assert light.position == pytest.approx(light.item.position)

    falling.put(Point(0.2, 0.2, 0.02))
    rest(world, 1)
    assert over not in world.facts

    rest(world, 20)
    assert light.position == pytest.approx(light.item.position)

    rest(world, 1)
    assert light.position.x > 5


def test_a_cube_that_falls_into_the_bin_is_gone_and_stays_counted():
    """What has vanished is parked at x > 5 m, 10 m high."""
    binned = Fact("binned", "a", "bin")
    objects = (
        SceneObject("bin", "bin", Point(0.1, 0.0, 0.025), yaw=0.2),
        cube("a", 0.1, 0.0, z=0.15),
        cube("b", 0.1, 0.2),
    )
    world = World(Scene(objects, (Vanish("a", binned),)), visible=False)
    steps = 0
    while binned not in world.facts:
        rest(world, 1)
        steps += 1
        assert steps < 20

    assert world.bodies["a"].position.x > 5

    rest(world, 10)
    assert binned in world.facts
    assert Fact("lying", "a") not in world.facts
    assert Fact("lying", "b") in world.facts
    assert world.bodies["a"].position.z == pytest.approx(10.0, abs=0.02)
