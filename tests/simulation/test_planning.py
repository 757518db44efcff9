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
from roboirg.tasks.shared.unmask import APPEAR_STEP
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim

DOWN = Rotation.from_quat([1.0, 0.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def planner():
    return MotionPlanner(World(get_episode("PickXtimes", "test", 0).scene, visible=False).robot)


def random_goals(count):
    rng = np.random.default_rng(1)
    for _ in range(count):
        position = rng.uniform([-0.3, -0.25, 0.0], [0.15, 0.25, 0.3])
        yield pose_with_yaw(position, rng.uniform(-0.8, 0.8))


def pose_with_yaw(position: np.ndarray, angle: float) -> ToolPose:
    return ToolPose(position, DOWN * Rotation.from_rotvec([0, 0, angle]))


def test_forward_kinematics_of_home_is_where_the_simulator_has_the_tool(planner):
    """Position of the tool in meters, at the arm's resting position."""
    assert planner.forward_kinematics(HOME).position == pytest.approx(
        [-0.0605, 0.0, 0.5211], abs=1e-4
    )


def test_planned_moves_are_straight_and_keep_the_limits_of_speed_and_acceleration(planner):
    """They end at the goal, and planning again gives the same path."""
    for goal in random_goals(12):
        path = planner.plan_straight(HOME, goal)
        assert path[0] == pytest.approx(HOME, abs=1e-9)
        end = planner.forward_kinematics(path[-1])
        assert end.position == pytest.approx(goal.position, abs=1e-5)
        assert (end.rotation.inv() * goal.rotation).magnitude() < 1e-5
        start = planner.forward_kinematics(path[0]).position
        along = (goal.position - start) / np.linalg.norm(goal.position - start)
        for arm in path:
            offset = planner.forward_kinematics(arm).position - start
            assert np.linalg.norm(offset - along * (offset @ along)) < 1e-3
        speed = np.diff(path, axis=0) / CONTROL_PERIOD
        # Samples are up to a fraction of a step closer in time than the control period.
        slack = len(path) / (len(path) - 1) * 1.02
        assert np.abs(speed).max() <= JOINT_SPEED_LIMIT * slack
        acceleration = np.diff(speed, axis=0) / CONTROL_PERIOD
        assert np.abs(acceleration).max() <= JOINT_ACCELERATION_LIMIT * slack**2 * 1.05
    assert np.array_equal(planner.plan_straight(HOME, goal), path)


def test_inverse_kinematics_finds_joint_positions_within_their_limits(planner):
    """From random positions, with one joint pushed against its limit."""
    rng = np.random.default_rng(2)
    for _ in range(15):
        begin = rng.uniform(JOINT_LOW, JOINT_HIGH)
        begin[rng.integers(7)] = 9.0  # pushed against a limit
        goal = planner.forward_kinematics(rng.uniform(JOINT_LOW, JOINT_HIGH))
        arm = planner.inverse_kinematics(begin, goal)
        found = planner.forward_kinematics(arm)
        assert np.abs(found.position - goal.position).max() < 2e-3
        assert (found.rotation.inv() * goal.rotation).magnitude() < 2e-3
        assert ((arm > JOINT_LOW - 1e-4) & (arm < JOINT_HIGH + 1e-4)).all()
        assert np.array_equal(planner.inverse_kinematics(begin, goal), arm)


def test_poses_one_centimeter_apart_need_small_joint_movements(planner):
    for goal in random_goals(10):
        arm = planner.plan_straight(HOME, goal)[-1]
        near = ToolPose(goal.position + np.array([0.01, -0.01, 0.01]), goal.rotation)
        assert np.abs(planner.inverse_kinematics(arm, near) - arm).max() < 0.2


@pytest.mark.parametrize("position", [(1.5, 0, 0.3), (1e308, -1e308, 0)])
def test_an_unreachable_pose_is_a_planning_error_even_with_huge_numbers(planner, position):
    goal = ToolPose(np.array(position, dtype=float), DOWN)
    for plan in (planner.inverse_kinematics, planner.plan_move):
        with pytest.raises(MotionPlanningError):
            plan(HOME, goal)


def test_a_pose_that_no_straight_line_reaches_is_reached_by_way_of_home(planner):
    """Home is the arm's resting position."""
    place = np.array([-0.1, 0.0, 0.2])
    twisted = planner.plan_straight(HOME, pose_with_yaw(place, -2.8))[-1]
    # The short way round would turn the last joint beyond its limit.
    goal = pose_with_yaw(place, 1.6)
    with pytest.raises(MotionPlanningError, match="joint limit"):
        planner.plan_straight(twisted, goal)

    path = planner.plan_move(twisted, goal)
    assert np.abs(path - HOME).max(axis=1).min() < 1e-6
    assert planner.forward_kinematics(path[-1]).position == pytest.approx(goal.position, abs=1e-5)


def test_a_move_to_where_one_is_takes_no_time():
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


@pytest.mark.parametrize("tilt", [0.0, 1e-4])
def test_a_goal_at_the_current_pose_does_not_lead_by_way_of_home(planner, tilt):
    start = planner.plan_straight(HOME, ToolPose(np.array([-0.1, 0.0, 0.2]), DOWN))[-1]
    place = planner.forward_kinematics(start)

    goal = ToolPose(place.position + tilt, place.rotation)

    assert len(planner.plan_move(start, goal)) <= 2


@pytest.mark.parametrize(
    ("travel", "low", "high"),
    [
        ((0, 0, -0.10), 20, 26),
        ((0, 0, -0.15), 20, 27),
        ((0, 0.10, 0), 16, 22),
        ((0, 0.2, 0), 22, 30),
    ],
)
def test_free_moves_take_as_long_as_robomme_s(planner, travel, low, high):
    """`travel` is in meters, `low` and `high` are numbers of control steps."""
    start = planner.plan_straight(HOME, ToolPose(np.array([-0.1, 0.0, 0.2]), DOWN))[-1]
    goal = ToolPose(np.array([-0.1, 0.0, 0.2]) + travel, DOWN)
    assert low <= len(planner.plan_straight(start, goal)) <= high


@pytest.mark.parametrize(
    ("task", "primitive", "low", "high"),
    [("PickXtimes", "pick_cube", 89, 157), ("VideoUnmask", "pick_container", 77, 134)],
)
def test_first_picks_take_as_long_as_robomme_s(task, primitive, low, high):
    for index in range(3):
        episode = get_episode(task, "test", index)
        world = World(episode.scene, visible=False)
        stage = next(stage for stage in episode.stages if stage.primitive.kind == primitive)
        rest(world, APPEAR_STEP + 8)  # containers have to be there and at rest
        begun = world.elapsed
        execute(world, stage.primitive)
        assert low <= world.elapsed - begun <= high
        assert stage.expects in world.facts


def is_picked_up(*objects: SceneObject) -> bool:
    """Whether the expert picks up the first of several objects."""
    world = World(Scene(objects), visible=False)
    execute(world, Primitive("pick_cube", objects[0].name))
    return Fact("picked", objects[0].name) in world.facts


def cube(name: str, x: float, y: float, yaw: float = 0.0) -> SceneObject:
    return SceneObject(name, "cube", Point(x, y, CUBE_HALF), yaw, "red")


def test_a_cube_at_the_edge_of_the_workspace_is_gripped_short_of_its_middle(planner):
    """Its middle is out of reach, but the near edge is not; 2 cm farther away, that is, too."""
    place = np.array([0.171, -0.159, CUBE_HALF])
    with pytest.raises(MotionPlanningError, match="cannot reach"):
        planner.plan_move(HOME, ToolPose(place, DOWN))
    assert is_picked_up(cube("far", *place[:2], yaw=2.22))
    with pytest.raises(MotionPlanningError, match="cannot reach"):
        is_picked_up(cube("too_far", place[0] + 0.02, place[1]))


def test_a_cube_between_close_neighbors_is_picked_with_half_open_fingers(monkeypatch):
    """Four cubes stand 7 cm around it; with open fingers the pick fails."""
    around = [(0.07, 0.0), (-0.07, 0.0), (0.0, 0.07), (0.0, -0.07)]
    cubes = [cube(f"cube_{number}", -0.05 + x, 0.1 + y) for number, (x, y) in enumerate(around)]
    assert is_picked_up(cube("middle", -0.05, 0.1), *cubes)

    monkeypatch.setattr(primitives, "NARROW", primitives.OPEN)
    assert not is_picked_up(cube("middle", -0.05, 0.1), *cubes)
