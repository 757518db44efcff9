"""A made-up episode of an expert, an honest policy that does the same, and other honest ones.

Where the expert goes next follows from where its joints are.
"""

from collections import deque
from functools import cache

import numpy as np

from roboirg.apps.policy_check.expert_episode import ExpertEpisode, ExpertMoment
from roboirg.core.actions import JOINT_HIGH, JOINT_LOW
from roboirg.core.observations import PICTURE_SIZE
from roboirg.core.policy_needs import PolicyNeeds

MOMENTS = 20
ROWS = 16
REST = np.array([0.0, 0.2, 0.0, -2.1, 0.0, 2.4, 0.8])
TEXT = "Take the red cube and press the button."
PICTURE = np.zeros((PICTURE_SIZE, PICTURE_SIZE, 3), np.uint8)


def path_from(joints, motion):
    """Return the joints of the next rows, at the last of which the motion is complete."""
    return joints + np.linspace(1 / ROWS, 1, ROWS)[:, None] * motion


def expert_motion(joints):
    return 0.1 * np.sin(40 * joints + np.arange(7))


@cache
def expert_episode():
    joints = REST.copy()
    moments = []
    for number in range(MOMENTS):
        gripper = 1.0 if number % 10 < 5 else -1.0
        path = path_from(joints, expert_motion(joints))
        observation = {
            "front_rgb": PICTURE,
            "wrist_rgb": PICTURE,
            "joint_positions": joints.astype(np.float32),
            "gripper": np.full(2, 0.04 if gripper > 0 else 0.02, np.float32),
            "end_effector": np.array([0.1, 0, 0.3, np.pi, 0, 0]),
            "instruction": TEXT,
        }
        moments.append(ExpertMoment(observation, np.column_stack([path, np.full(ROWS, gripper)])))
        joints = np.clip(path[-1], JOINT_LOW + 0.1, JOINT_HIGH - 0.1)
    empty = {"joint_positions": np.zeros((0, 7), np.float32), "gripper": np.zeros((0, 2))}
    return ExpertEpisode(TEXT, empty, moments)


def record(policy, rows):
    """Stand in for the simulator: the same episode for every policy, cut to its chunks."""
    whole = expert_episode()
    moments = [moment._replace(actions=moment.actions[:rows]) for moment in whole.moments]
    if PolicyNeeds.of(policy).observe_every:
        shown = [{**moment.observation, "history": (moment.observation,)} for moment in moments]
        moments = [m._replace(observation=o) for m, o in zip(moments, shown, strict=True)]
    return whole._replace(moments=moments)


class Honest:
    """Does what the expert does; what it remembers of an episode has a small effect."""

    def __init__(self, seed=0):
        self.seed = seed

    def reset(self, instruction, demonstration):
        self.memory = len(instruction) + float(demonstration["joint_positions"].sum())

    def motion(self, joints):
        return expert_motion(joints)

    def gripper(self, observation):
        return 1.0 if observation["gripper"][0] > 0.03 else -1.0

    def act(self, observation):
        joints = np.asarray(observation["joint_positions"], np.float64)
        path = path_from(joints, self.motion(joints) + 1e-5 * self.memory)
        return np.column_stack([path, np.full(ROWS, self.gripper(observation))])


class OneByOne(Honest):
    """Honest; computes a chunk and gives it action by action, as LeRobot's policies."""

    def reset(self, instruction, demonstration):
        super().reset(instruction, demonstration)
        self.queue = deque()

    def act(self, observation):
        if not self.queue:
            self.queue.extend(super().act(observation)[:3])
        return self.queue.popleft()


class Noisy(Honest):
    """Honest about its noise."""

    deterministic = False

    def act(self, observation):
        return super().act(observation) + np.random.default_rng().normal(0, 1e-4, (ROWS, 8))


class Untrained(Honest):
    """Honest; random weights."""

    def motion(self, joints):
        return np.random.default_rng([3, self.seed]).normal(0, 0.05, (7, 7)) @ joints

    def gripper(self, observation):
        return np.tanh(observation["joint_positions"][0])


HONEST = (Honest, OneByOne, Noisy, Untrained)
