"""A made-up episode of an expert, an honest policy that learned from it, and mistakes of others.

What the expert is about to do is drawn into the pictures of two cameras, in colors. The honest
policy reads it out of them by least squares, adds it to the joints, and lets the words, the video
and the history change its answers a little.
"""

import zlib
from collections import deque
from functools import cache

import numpy as np

from roboirg.apps.policy_check.expert_episode import ExpertEpisode, ExpertMoment
from roboirg.core.actions import JOINT_HIGH, JOINT_LOW
from roboirg.policies.contract.policy_needs import PolicyNeeds

MOMENTS, ROWS, SIDE, LATENT = 20, 16, 8, 4
REST = np.array([0.0, 0.2, 0.0, -2.1, 0.0, 2.4, 0.8])
TEXT = "Take the red cube and press the button."


def paint(latent, basis):
    """Draw numbers as a picture: a sum of colored patterns."""
    small = 128 + 40 * np.tensordot(latent, basis, axes=1)
    picture = np.clip(small, 0, 255).astype(np.uint8)
    return np.kron(picture, np.ones((256 // SIDE, 256 // SIDE, 1), np.uint8))


@cache
def expert_episode():
    rng = np.random.default_rng(5)
    bases = rng.uniform(-1, 1, (2, LATENT, SIDE, SIDE, 3))
    to_motion = rng.normal(0, 0.05, (2 * LATENT, 7))
    joints, moments = REST.copy(), []
    for number in range(MOMENTS):
        latents = rng.uniform(-1, 1, (2, LATENT))
        motion = latents.ravel() @ to_motion
        gripper = 1.0 if number % 10 < 5 else -1.0
        path = joints + np.linspace(1 / ROWS, 1, ROWS)[:, None] * motion
        pictures = [paint(*one) for one in zip(latents, bases, strict=True)]
        observation = {
            "front_rgb": pictures[0],
            "wrist_rgb": pictures[1],
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
    moments = [one._replace(actions=one.actions[:rows]) for one in whole.moments]
    if PolicyNeeds.of(policy).observe_every:
        shown = [{**one.observation, "history": (one.observation,)} for one in moments]
        moments = [m._replace(observation=o) for m, o in zip(moments, shown, strict=True)]
    return whole._replace(moments=moments)


def pixels(front, wrist):
    """Return what the policy sees of two pictures, as one row of numbers."""
    small = [np.asarray(one, np.float64)[16::32, 16::32].ravel() for one in (front, wrist)]
    return np.append(np.concatenate(small), 128.0) / 128


@cache
def weights():
    moments = expert_episode().moments
    seen = np.stack(
        [pixels(one.observation["front_rgb"], one.observation["wrist_rgb"]) for one in moments]
    )
    motion = np.stack([one.actions[-1, :7] - one.still for one in moments])
    return np.linalg.lstsq(seen, motion, rcond=None)[0]


class Honest:
    """Does what it learned; everything that it is given has a small effect."""

    def __init__(self, seed=0):
        self.seed = seed

    def reset(self, instruction, demonstration):
        self.instruction, self.calls = instruction, 0
        seen = (demonstration.get(name, ()) for name in ("front_rgb", "joint_positions"))
        self.memory = sum(float(np.sum(one, dtype=float)) for one in seen)

    def trace(self, observation):
        """Return a small number that depends on the words, the video and the call."""
        self.calls += 1
        return 1e-5 * ((zlib.crc32(self.instruction.encode()) + self.memory) % 997 + self.calls)

    def see(self, observation):
        return pixels(observation["front_rgb"], observation["wrist_rgb"])

    def joints(self, observation):
        return np.asarray(observation["joint_positions"], np.float64)

    def gripper(self, observation):
        return 1.0 if observation["gripper"][0] > 0.03 else -1.0

    def act(self, observation):
        motion = self.see(observation) @ weights() + self.trace(observation)
        path = self.joints(observation) + np.linspace(1 / ROWS, 1, ROWS)[:, None] * motion
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

    def act(self, observation):
        rng = np.random.default_rng([3, self.seed])
        motion = self.see(observation) @ rng.normal(0, 0.01, weights().shape)
        motion += self.trace(observation)
        path = self.joints(observation) + np.linspace(1 / ROWS, 1, ROWS)[:, None] * motion
        return np.column_stack([path, np.full(ROWS, np.tanh(motion[0]))])


HONEST = (Honest, OneByOne, Noisy, Untrained)
