"""Learned policies as policies in joint angles, which every policy server can offer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.policies import Demonstration, Observation
from roboirg.extension.sight import LOOK_EVERY, ObservedRobot
from roboirg_learn.policy.learned_policy import LearnedPolicy
from roboirg_learn.policy.subgoal_following import LearnedHands

JointTrajectory = NDArray[np.floating[Any]]
"""Joint angles with the gripper (T, 8), rad."""
NO_ROWS: JointTrajectory = np.empty((0, 8))


class JointChunks:
    """Plans the waypoints of a learned policy, and returns the plan in chunks of joint angles.

    A chunk ends where the policy looks next, after at most eight rows; all of them must be executed
    before the next call of `act`. Joint positions, fingers and pictures of the front camera are all
    that is read of observations and of the video: the tool's pose is computed, and a history is not
    needed. While a waypoint cannot be reached the robot keeps still, and the policy is asked again
    at each look.

    Args:
        policy: chooses the waypoints.
    """

    cameras = ("front",)
    actions: ClassVar[str] = "joint_angle"
    demonstration_frames = LOOK_EVERY

    def __init__(self, policy: LearnedPolicy) -> None:
        self.policy = policy
        self.version = policy.version
        self.trained_tasks = policy.trained_tasks

    @property
    def metadata(self) -> dict[str, Any]:
        """How the policy was trained."""
        return self.policy.metadata

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode, and look at the video.

        The video's pictures are of every step or of every eighth; without a video it is empty.
        """
        self._robot = ObservedRobot()
        self._steps = 0
        self._gripper = 1.0  # open
        # The trajectories of the waypoint under way that are left, and the rows left of the present
        # one.
        self._plan: Iterator[JointTrajectory] = iter(())
        self._rows = NO_ROWS
        video = demonstration
        if len(demonstration["joint_positions"]):
            video = self._with_tool(demonstration)
        self.policy.reset(instruction, video)

    def _with_tool(self, video: Demonstration) -> Demonstration:
        """Return a video with the tool's pose at each step, computed from joints and fingers.

        Pictures may be of each step or of every eighth already; every eighth is returned.
        """
        joints = video["joint_positions"]
        fingers = video["gripper"]
        pictures = video["front_rgb"]
        has_all_pictures = len(pictures) == len(joints)
        states = [self._robot.observe(*state) for state in zip(joints, fingers, strict=True)]
        return {
            "joint_positions": joints,
            "gripper": fingers,
            "end_effector": np.stack([state["end_effector"] for state in states]),
            "front_rgb": pictures[::LOOK_EVERY] if has_all_pictures else pictures,
        }

    def hear(self, text: str, step: int) -> None:
        """Hear another utterance."""
        self.policy.hear(text, step)

    def act(self, observation: Observation) -> JointTrajectory:
        """Return joint angles with the gripper, rad, until the next look: (n, 8), n <= 8.

        Rows of the waypoint under way go first; when there are none the policy is asked for the
        next waypoint. A waypoint that cannot be reached has no rows: the robot keeps still until
        the next look.
        """
        state = self._robot.observe(observation["joint_positions"], observation["gripper"])
        now = cast("Observation", {**observation, **state, "history": ()})
        until_look = LOOK_EVERY - self._steps % LOOK_EVERY
        if not len(self._rows):
            # After the move this plans the gripper's motion where the arm has arrived.
            self._rows = next(self._plan, NO_ROWS)
        if not len(self._rows):
            (waypoint,) = self.policy.act(now)
            self._plan = self._robot.plan(waypoint)
            still = np.append(state["joint_positions"], self._gripper)
            self._rows = next(self._plan, np.tile(still, (until_look, 1)))
        elif until_look == LOOK_EVERY:
            # In the midst of a waypoint it is time for a look, though not for a decision.
            self.policy.watch(now)

        chunk = self._rows[:until_look]
        self._rows = self._rows[until_look:]
        self._steps += len(chunk)
        self._gripper = float(chunk[-1, -1])
        return chunk


class JointChunksOfHands(JointChunks):
    """The same for hands, which follow subgoals."""

    policy: LearnedHands

    @property
    def subgoal(self) -> str | None:
        """The one that they follow."""
        return self.policy.subgoal

    def follow(self, subgoal: str) -> None:
        """Set the subgoal, which holds from the next waypoint on."""
        self.policy.follow(subgoal)
