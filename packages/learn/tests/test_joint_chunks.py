"""A policy that acts in waypoints as one that acts in joint angles."""

from types import SimpleNamespace

import numpy as np
import pytest

from roboirg.core.policy_needs import PolicyNeeds
from roboirg.envs.factory import make
from roboirg.policies import play
from roboirg.policies.builtin.waypoint_expert import WaypointExpert
from roboirg.simulation.physics_settings import HOME
from roboirg.tasks.splits.splits import get_episode
from roboirg_learn.policy.joint_chunks import JointChunks
from roboirg_learn.policy.learned_policy import LearnedPolicy


class PolicyWithFixedWaypoints(LearnedPolicy):
    """Returns waypoints in order, and keeps what it sees."""

    def __init__(self, waypoints):
        reader = SimpleNamespace(plan={"tasks": ["ButtonUnmask"]})
        super().__init__(SimpleNamespace(reader=reader, version="rehearsed"))
        self.waypoints = waypoints
        self.pictures = []
        self.tools = []

    def reset(self, instruction, demonstration):
        self.left, self.demonstration, self.seen = [*self.waypoints], demonstration, self

    def look(self, pictures, tools, *, is_video):
        self.pictures += pictures
        self.tools += tools

    def act(self, observation):
        self.watch(observation)
        return self.left.pop(0)


class ExpertThatNotesItsWaypoints(PolicyWithFixedWaypoints):
    """Acts as the expert does, and keeps its waypoints, pictures and poses of the tool."""

    def __init__(self):
        super().__init__([])
        self.expert = WaypointExpert()

    def attach(self, env):
        self.expert.attach(env)

    def reset(self, instruction, demonstration):
        super().reset(instruction, demonstration)
        self.expert.reset(instruction, demonstration)

    def act(self, observation):
        self.left.append(self.expert.act(observation))
        self.waypoints.append(self.left[-1])
        return super().act(observation)


def play_button_unmask(policy):
    """Return how the policy's play of one episode ended: its status and number of steps."""
    episode = get_episode("ButtonUnmask", "train", 0)
    return play(make(episode, **PolicyNeeds.of(policy).env_options), policy)


@pytest.mark.sim
def test_a_policy_of_waypoints_that_is_run_in_joint_angles_does_and_sees_the_same():
    """The expert solves an episode with waypoints: poses, to each of which the arm moves.

    Then a second policy answers with these waypoints, and `JointChunks` turns each into joint
    angles, eight control steps at a time. The arm moves along the same path, so that the episode
    ends alike, and both policies see the same pictures and poses of the tool (in meters).
    """
    expert = ExpertThatNotesItsWaypoints()
    end_in_waypoints = play_button_unmask(expert)
    repeater = PolicyWithFixedWaypoints(expert.waypoints)

    end_in_joint_angles = play_button_unmask(JointChunks(repeater))

    assert end_in_waypoints["status"] == end_in_joint_angles["status"] == "success"
    assert end_in_waypoints["steps"] == end_in_joint_angles["steps"]
    # In joint angles the policy is asked, and sees, some more times within the last waypoint.
    seen_by_both = slice(len(expert.tools))
    assert np.allclose(expert.tools, repeater.tools[seen_by_both], atol=1e-5)
    assert np.array_equal(expert.pictures, repeater.pictures[seen_by_both])


STATE = {"front_rgb": 0, "joint_positions": HOME, "gripper": np.full(2, 0.04)}


VIDEO_OF_TEN_STEPS = {
    "joint_positions": np.tile(HOME, (10, 1)),
    "gripper": np.full((10, 2), 0.04),
    "front_rgb": np.arange(10),
}


@pytest.mark.sim
def test_an_unreachable_waypoint_becomes_eight_steps_of_waiting():
    """The waypoint is two meters away in each direction, where the arm cannot reach.

    To wait is to stay at the home joint angles with the gripper open (1), for the eight steps of a
    chunk.
    """
    far = np.array([[2.0, 2.0, 2.0, np.pi, 0.0, 0.0, 0.0]])
    chunks = JointChunks(PolicyWithFixedWaypoints([far]))
    chunks.reset("wait", VIDEO_OF_TEN_STEPS)

    assert np.allclose(chunks.act(STATE), np.tile([*HOME, 1.0], (8, 1)))


@pytest.mark.sim
@pytest.mark.parametrize("drawn", [np.arange(10), np.arange(0, 10, 8)], ids=["all", "every 8th"])
def test_every_eighth_frame_of_a_video_is_passed_on(drawn):
    """Of ten steps these are frames 0 and 8, whether all were drawn or only every eighth.

    A frame is its number here. The pose of the tool (position and rotation, 6 numbers) is passed on
    for each of the ten steps.
    """
    policy = PolicyWithFixedWaypoints([])

    JointChunks(policy).reset("wait", {**VIDEO_OF_TEN_STEPS, "front_rgb": drawn})

    assert policy.demonstration["front_rgb"].tolist() == [0, 8]
    assert policy.demonstration["end_effector"].shape == (10, 6)
