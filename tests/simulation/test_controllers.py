"""Poses as actions: they arrive, they count their steps, and they fail in words."""

import numpy as np
import pytest

import roboirg
from roboirg.core.conditions import Fact

pytestmark = pytest.mark.sim

DOWN = (np.pi, 0.0, 0.0)
"""Roll, pitch and yaw of fingers that point down, radians."""


def environment_with_actions(actions, **options):
    """Return an environment without cameras that was reset; by default it has pick and place."""
    env = roboirg.make("PickXtimes", episode=2, cameras=(), actions=actions, **options)
    env.reset()
    return env


def test_repeated_pose_actions_take_the_tool_to_the_pose():
    """A pose is x, y, z in meters, and roll, pitch and yaw in radians. After 30 steps the tool is
    within 2 mm or 0.002 rad of it in each, and the fingers, 0.04 m from the middle when open,
    are closed to 2 mm."""
    env = environment_with_actions("ee_pose")
    pose = np.array([-0.1, 0.1, 0.25, np.pi - 0.2, 0.1, 0.4])
    closed = -1.0

    for _ in range(30):
        observation, *_ = env.step([*pose, closed])

    error = observation["end_effector"] - pose
    error[3:] = (error[3:] + np.pi) % (2 * np.pi) - np.pi  # pi and -pi are the same angle
    assert np.abs(error).max() < 2e-3
    assert observation["gripper"].max() < 0.002


def test_a_pose_action_takes_one_control_step():
    """A pose is x, y, z in meters, and roll, pitch and yaw of fingers that point down; the last
    number, 1, opens the gripper. One call is one step, although the arm is not there yet."""
    env = environment_with_actions("ee_pose")

    *_, info = env.step([-0.1, 0.1, 0.25, *DOWN, 1.0])

    assert info["steps"] == 1


def test_a_pick_and_place_task_is_solved_with_waypoint_actions():
    """A waypoint is a pose to which the arm moves straight, in as many steps as it takes.

    The last number of an action is the gripper: -1 closes it, 1 opens it, and in between it stays
    as it is. The goal is to put the blue cube onto the target and to press the button.
    """
    env = environment_with_actions("waypoint")
    assert env.episode.goal.as_mapping() == {"color": "blue", "repeats": 1}
    bodies = env.session.world.bodies
    yaw = env.episode.scene["cube_blue"].yaw % (np.pi / 2)  # a cube looks the same every 90°

    def go(name, height, gripper, turn=0.0):
        x, y, _ = bodies[name].position
        return env.step([x, y, height, np.pi, 0.0, turn, gripper])

    go("cube_blue", 0.15, 1, yaw)
    go("cube_blue", 0.02, -1, yaw)
    go("cube_blue", 0.15, 0, yaw)
    assert Fact("picked", "cube_blue") in env.session.world.facts
    go("target", 0.15, 0.3, yaw)
    go("target", 0.02, 1, yaw)
    go("target", 0.15, 0.999, yaw)
    go("button", 0.15, -1)
    *_, info = go("button", 0.0075, -1)

    assert info["status"] == "success"


def step_at_the_tool_s_place(gripper):
    """Return the observation and the steps of a waypoint where the tool is already."""
    env = environment_with_actions("waypoint")
    here = env.session.world.robot.tool_pose.p
    observation, *_, info = env.step([*here, *DOWN, gripper])
    return observation, info["steps"]


def test_a_waypoint_at_the_tool_s_place_closes_the_gripper_at_minus_one():
    """The last number of a waypoint is the gripper: -1 closes it. The arm has no way to go, but the
    fingers, 0.04 m from the middle each, take about 7 control steps to meet."""
    observation, steps = step_at_the_tool_s_place(gripper=-1.0)

    assert 5 <= steps <= 9
    assert observation["gripper"] == pytest.approx([0.0, 0.0], abs=0.005)


def test_a_waypoint_at_the_tool_s_place_leaves_the_gripper_alone_between_minus_one_and_one():
    """The last number of a waypoint is the gripper: -1 closes it, 1 opens it, and in between it
    stays as it is. So at 0.5 nothing moves, which takes a single step, and the fingers stay open,
    0.04 m from the middle each."""
    observation, steps = step_at_the_tool_s_place(gripper=0.5)

    assert steps == 1
    assert observation["gripper"] == pytest.approx([0.04, 0.04], abs=0.005)


@pytest.mark.parametrize(
    ("actions", "reason"),
    [("ee_pose", "no joint positions reach"), ("waypoint", "no straight move reaches")],
)
def test_an_unreachable_pose_fails_the_episode_with_the_pose_in_its_cause(actions, reason):
    """The arm reaches less than 0.9 m, and the pose is 1.5 m ahead. Whether poses are reached step
    by step (`ee_pose`) or in a straight move (`waypoint`), the episode fails before a step is
    made."""
    env = environment_with_actions(actions)

    _, reward, terminated, truncated, info = env.step([1.5, 0.0, 0.3, *DOWN, 1.0])

    pose = "(1.500, 0.000, 0.300) with roll 3.142, pitch 0.000, yaw 0.000"
    assert (reward, terminated, truncated) == (0.0, True, False)
    assert (info["status"], info["steps"]) == ("failure", 0)
    assert info["cause"] == f"{reason} {pose}"


def test_an_episode_times_out_in_the_middle_of_a_waypoint_move():
    """Ten steps are allowed, and the straight move down to a height of 0.1 m takes more; it is cut
    off after ten."""
    env = environment_with_actions("waypoint", max_steps=10)

    *_, terminated, truncated, info = env.step([-0.1, 0.1, 0.1, *DOWN, -1.0])

    assert (terminated, truncated) == (False, True)
    assert (info["status"], info["steps"]) == ("timeout", 10)
