"""Poses as actions: they arrive, they count their steps, and they fail in words."""

import numpy as np
import pytest

import roboirg
from roboirg.core.conditions import Fact
from roboirg.simulation.physics_settings import HOME_ACTION

pytestmark = pytest.mark.sim

DOWN = (np.pi, 0.0, 0.0)
OUT_OF_REACH = (1.5, 0.0, 0.3, *DOWN, 1.0)


def environment_with_actions(actions, **options):
    env = roboirg.make("PickXtimes", episode=2, cameras=(), actions=actions, **options)
    env.reset()
    return env


def test_a_pose_action_is_one_control_step_toward_the_pose():
    """A pose is x, y, z in meters, roll, pitch, yaw in radians, and the gripper (-1 closes)."""
    env = environment_with_actions("ee_pose")
    assert env.action_space.shape == (7,)

    goal = np.array([-0.1, 0.1, 0.25, np.pi - 0.2, 0.1, 0.4])
    info = {}
    for step in range(1, 31):
        observation, *_, info = env.step(np.append(goal, -1.0))
        assert info["steps"] == step

    reached = observation["end_effector"] - goal
    reached[3:] = (reached[3:] + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(reached).max() < 2e-3
    assert observation["gripper"].max() < 0.002


def test_pose_actions_reach_the_place_that_joint_angles_reached():
    joints = environment_with_actions("joint_angle")
    poses = environment_with_actions("ee_pose")
    target = HOME_ACTION + np.array([0.1, 0.1, -0.1, -0.1, 0.1, 0.1, 0.1, 0.0])
    for _ in range(30):
        wanted, *_ = joints.step(target)

    for _ in range(40):
        got, *_ = poses.step(np.append(wanted["end_effector"], 1.0))

    assert got["end_effector"] == pytest.approx(wanted["end_effector"], abs=2e-3)


def test_a_pick_and_place_task_is_solved_with_waypoint_actions():
    """A waypoint is a pose to which the arm moves straight, in as many steps as it takes."""
    env = environment_with_actions("waypoint")
    bodies = env.session.world.bodies
    slots = env.episode.goal.as_mapping()
    name = f"cube_{slots['color']}"
    yaw = env.episode.scene[name].yaw
    yaw = (yaw + np.pi / 4) % (np.pi / 2) - np.pi / 4

    def go(place, height, gripper, turn=yaw):
        return env.step([place.x, place.y, height, np.pi, 0.0, turn, gripper])

    for _ in range(slots["repeats"]):
        cube = bodies[name].position
        for height, gripper in ((0.15, 1), (0.02, -1), (0.15, 0)):
            go(cube, height, gripper)
        assert Fact("picked", name) in env.session.world.facts
        # Neither -1 nor +1: the gripper stays as it was, closed.
        for height, gripper in ((0.15, 0.3), (0.02, 1), (0.15, 0.999)):
            go(bodies["target"].position, height, gripper)
    go(bodies["button"].position, 0.15, -1, turn=0.0)
    *_, terminated, truncated, info = go(bodies["button"].position, 0.0075, -1, turn=0.0)

    assert (info["status"], terminated, truncated) == ("success", True, False)


def test_the_gripper_moves_only_for_exactly_minus_or_plus_one():
    """Closing takes about six control steps."""
    env = environment_with_actions("waypoint")
    here = env.session.world.robot.tool_pose.p
    observation, *_, info = env.step([*here, *DOWN, 0.5])
    moved = info["steps"]

    assert moved < 5
    assert observation["gripper"].min() > 0.039

    observation, *_, info = env.step([*here, *DOWN, -1.0])
    assert info["steps"] - 2 * moved in range(4, 9)  # the move to where it is, twice
    assert observation["gripper"].max() < 0.005


@pytest.mark.parametrize("actions", ["ee_pose", "waypoint"])
def test_an_unreachable_pose_fails_the_episode_with_the_pose_in_its_cause(actions):
    env = environment_with_actions(actions)
    _, reward, terminated, truncated, info = env.step(OUT_OF_REACH)
    assert (reward, terminated, truncated) == (0.0, True, False)
    assert (info["status"], info["steps"]) == ("failure", 0)

    reached = "no joint positions reach" if actions == "ee_pose" else "no straight move reaches"
    words = f"{reached} (1.500, 0.000, 0.300) with roll 3.142, pitch 0.000, yaw 0.000"
    assert info["cause"] == words


def test_an_episode_times_out_in_the_middle_of_a_waypoint_move():
    env = environment_with_actions("waypoint", max_steps=10)
    *_, terminated, truncated, info = env.step([-0.1, 0.1, 0.1, *DOWN, -1.0])

    assert (terminated, truncated) == (False, True)
    assert (info["status"], info["steps"]) == ("timeout", 10)
