"""Straight moves are straight, within limits, and end where they should."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from moved_worlds import execute, rest
from scipy.spatial.transform import Rotation

from roboirg.core.actions import JOINT_HIGH, JOINT_LOW
from roboirg.core.conditions import Fact
from roboirg.core.episode import Primitive, Scene, SceneObject
from roboirg.core.errors import MotionPlanningError
from roboirg.core.motions import Point
from roboirg.core.object_sizes import CUBE_HALF
from roboirg.simulation.expert import primitives
from roboirg.simulation.expert.motion_planning import MotionPlanner, ToolPose
from roboirg.simulation.expert.trajectory_timing import (
    JOINT_ACCELERATION_LIMIT,
    JOINT_SPEED_LIMIT,
    time_parameterize,
)
from roboirg.simulation.physics_settings import CONTROL_PERIOD, HOME
from roboirg.simulation.world import World
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim

DOWN = Rotation.from_quat([1.0, 0.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def planner():
    return MotionPlanner(World(get_episode("PickXtimes", "test", 0).scene, visible=False).robot)


def pose_facing_down(x, y, z, yaw=0.0):
    """Return the tool's pose at a point, m, with the fingers down and turned, radians."""
    return ToolPose(np.array([x, y, z], float), DOWN * Rotation.from_rotvec([0, 0, yaw]))


def angle_between(pose, other):
    return (pose.rotation.inv() * other.rotation).magnitude()


def random_poses(count):
    """Return poses all over the workspace."""
    rng = np.random.default_rng(1)
    low = [-0.3, -0.25, 0.0, -0.8]
    high = [0.15, 0.25, 0.3, 0.8]
    return [pose_facing_down(*rng.uniform(low, high)) for _ in range(count)]


def test_forward_kinematics_of_home_is_where_the_simulator_has_the_tool(planner):
    """Position of the tool in meters, at the arm's resting position."""
    home = planner.forward_kinematics(HOME)

    assert home.position == pytest.approx([-0.0605, 0.0, 0.5211], abs=1e-4)


def test_a_planned_path_leads_from_the_start_to_the_goal(planner):
    """For a dozen random poses: a path is rows of joint positions, from the arm's resting position,
    HOME, to ones that have the tool within 0.01 mm and 1e-5 rad of the pose."""
    for goal in random_poses(12):
        path = planner.plan_straight(HOME, goal)

        end = planner.forward_kinematics(path[-1])
        assert path[0] == pytest.approx(HOME, abs=1e-9)
        assert end.position == pytest.approx(goal.position, abs=1e-5)
        assert angle_between(end, goal) < 1e-5


def test_a_planned_path_is_straight_within_a_millimeter(planner):
    """For a dozen random poses: the tool's distance from the straight line between start and goal,
    `sideways`, at every row of joint positions."""
    start = planner.forward_kinematics(HOME).position
    for goal in random_poses(12):
        direction = (goal.position - start) / np.linalg.norm(goal.position - start)

        for joints in planner.plan_straight(HOME, goal):
            offset = planner.forward_kinematics(joints).position - start
            sideways = offset - direction * (offset @ direction)
            assert np.linalg.norm(sideways) < 1e-3


def test_a_planned_path_keeps_the_limits_of_speed_and_acceleration(planner):
    """A path has a row of joint positions for each control step, at equal times. It would last up
    to a control period longer than it has rows, and there is one interval less than rows: played a
    row each period, it is faster by up to `slack`, and its accelerations by the square. These are
    differences of differences; 5 % is their tolerance."""
    for goal in random_poses(12):
        path = planner.plan_straight(HOME, goal)

        speed = np.diff(path, axis=0) / CONTROL_PERIOD
        acceleration = np.diff(speed, axis=0) / CONTROL_PERIOD

        slack = (len(path) + 1) / (len(path) - 1)
        assert np.abs(speed).max() <= slack * JOINT_SPEED_LIMIT
        assert np.abs(acceleration).max() <= 1.05 * slack**2 * JOINT_ACCELERATION_LIMIT


def test_inverse_kinematics_finds_joint_positions_within_their_limits(planner):
    """From random positions, with one joint far beyond its limit."""
    rng = np.random.default_rng(2)
    for _ in range(15):
        begin = rng.uniform(JOINT_LOW, JOINT_HIGH)
        begin[rng.integers(7)] = 9.0
        goal = planner.forward_kinematics(rng.uniform(JOINT_LOW, JOINT_HIGH))

        joints = planner.inverse_kinematics(begin, goal)

        reached = planner.forward_kinematics(joints)
        assert reached.position == pytest.approx(goal.position, abs=2e-3)
        assert angle_between(reached, goal) < 2e-3
        assert (joints > JOINT_LOW - 1e-4).all()
        assert (joints < JOINT_HIGH + 1e-4).all()


def test_poses_one_centimeter_apart_need_small_joint_movements(planner):
    """For ten random poses, and the same 1 cm away along each axis: no joint moves by more than 0.2
    rad, so no other way to bend the arm is chosen."""
    for goal in random_poses(10):
        joints = planner.plan_straight(HOME, goal)[-1]
        near = ToolPose(goal.position + np.array([0.01, -0.01, 0.01]), goal.rotation)

        moved = planner.inverse_kinematics(joints, near)

        assert moved == pytest.approx(joints, abs=0.2)


@pytest.mark.parametrize("method", ["inverse_kinematics", "plan_move"])
@pytest.mark.parametrize("position", [(1.5, 0, 0.3), (1e308, -1e308, 0)])
def test_an_unreachable_pose_is_a_planning_error_even_with_huge_numbers(planner, method, position):
    with pytest.raises(MotionPlanningError):
        getattr(planner, method)(HOME, pose_facing_down(*position))


def test_a_pose_that_no_straight_line_reaches_is_reached_by_way_of_home(planner):
    """Home is the arm's resting position. The short way turns the last joint beyond its limit."""
    twisted = planner.plan_straight(HOME, pose_facing_down(-0.1, 0.0, 0.2, yaw=-2.8))[-1]
    goal = pose_facing_down(-0.1, 0.0, 0.2, yaw=1.6)
    with pytest.raises(MotionPlanningError, match="joint limit"):
        planner.plan_straight(twisted, goal)

    path = planner.plan_move(twisted, goal)

    end = planner.forward_kinematics(path[-1])
    assert np.abs(path - HOME).max(axis=1).min() < 1e-6
    assert end.position == pytest.approx([-0.1, 0.0, 0.2], abs=1e-5)


def test_a_move_to_where_one_is_takes_no_time():
    """A path from the resting position to itself is one row of seven joint positions."""
    assert time_parameterize(np.stack([HOME, HOME])).shape == (1, 7)


@settings(max_examples=30)
@given(
    exponent=st.floats(-7.0, -2.0),
    direction=st.lists(st.floats(-1.0, 1.0), min_size=7, max_size=7).filter(any),
)
def test_every_short_move_has_a_timing(exponent, direction):
    """Moves of a ten-millionth to a hundredth of a radian, in any direction."""
    way = np.array(direction) / np.linalg.norm(direction) * 10.0**exponent
    path = time_parameterize(np.stack([HOME, HOME + way]))

    assert path[0] == pytest.approx(HOME)
    assert path[-1] == pytest.approx(HOME + way, abs=1e-6)


@pytest.mark.parametrize("distance_m", [0.0, 1e-4])
def test_a_goal_at_the_current_pose_does_not_lead_by_way_of_home(planner, distance_m):
    """The goal is where the tool is, or 0.1 mm away in each direction. A path by way of the resting
    position would have dozens of rows."""
    start = planner.plan_straight(HOME, pose_facing_down(-0.1, 0.0, 0.2))[-1]
    place = planner.forward_kinematics(start)

    path = planner.plan_move(start, ToolPose(place.position + distance_m, place.rotation))

    assert len(path) <= 2


@pytest.mark.parametrize(
    ("task", "primitive", "fewest", "most"),
    [("PickXtimes", "pick_cube", 89, 157), ("VideoUnmask", "pick_container", 77, 134)],
)
@pytest.mark.parametrize("index", range(3))
def test_first_picks_take_as_many_control_steps_as_robomme_s(task, index, primitive, fewest, most):
    """The first 40 steps let containers appear and come to rest. Then the pick is executed, which
    RoboMME's data take between `fewest` and `most` control steps for, and it must succeed."""
    episode = get_episode(task, "test", index)
    stage = next(stage for stage in episode.stages if stage.primitive.kind == primitive)
    world = rest(World(episode.scene, visible=False), 40)

    execute(world, stage.primitive)

    assert fewest <= world.elapsed - 40 <= most
    assert stage.expects in world.facts


def is_picked_up(*objects):
    """Return whether the expert picks up the first of several objects on a table."""
    world = World(Scene(objects), visible=False)
    execute(world, Primitive("pick_cube", objects[0].name))
    return Fact("picked", objects[0].name) in world.facts


def cube(name, x, y, yaw=0.0):
    return SceneObject(name, "cube", Point(x, y, CUBE_HALF), yaw, "red")


def test_a_cube_at_the_edge_of_the_workspace_is_gripped_short_of_its_middle(planner):
    """Its middle, 20 mm above the table, is out of reach, but its near edge is not."""
    with pytest.raises(MotionPlanningError, match="cannot reach"):
        planner.plan_move(HOME, pose_facing_down(0.171, -0.159, 0.02))

    assert is_picked_up(cube("far", 0.171, -0.159, yaw=2.22))


def test_a_cube_beyond_the_workspace_is_a_planning_error():
    """It is 2 cm farther than a cube at (0.171, -0.159) m, whose near edge is just in reach."""
    with pytest.raises(MotionPlanningError, match="cannot reach"):
        is_picked_up(cube("too_far", 0.191, -0.159))


FIVE_CUBES = (
    cube("middle", -0.05, 0.10),
    cube("behind", 0.02, 0.10),
    cube("before", -0.12, 0.10),
    cube("left", -0.05, 0.17),
    cube("right", -0.05, 0.03),
)
"""One in the middle of four others, which are 7 cm away."""


def test_a_cube_between_close_neighbors_is_picked():
    """Four other cubes stand 7 cm from its middle on all sides. A cube is 4 cm wide, so 3 cm are
    left for the fingers."""
    assert is_picked_up(*FIVE_CUBES)


def test_open_fingers_would_not_fit_between_close_neighbors(monkeypatch):
    """A check of the test that a cube with neighbors 7 cm away on all sides is picked: there the
    fingers are half open, which is called narrow. With NARROW replaced by OPEN they hit the
    neighbors, so the pick fails."""
    monkeypatch.setattr(primitives, "NARROW", primitives.OPEN)

    assert not is_picked_up(*FIVE_CUBES)
