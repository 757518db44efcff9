"""The simulator's expert as a reference: what is recorded, and what is found with it."""

import functools
import itertools

import numpy as np
import pytest

from roboirg.apps.policy_check.check_result import FAIL, NOTE, PASS, WARN
from roboirg.apps.policy_check.expert_episode import MAX_ROWS, ExpertEpisode, record_expert
from roboirg.apps.policy_check.policy_check import check_policy
from roboirg.core.episode import ROBOT_BASE
from roboirg.core.errors import RenderDeviceError

pytestmark = pytest.mark.sim
ROWS = 16


class Seeing:
    """Asks for the pictures of both cameras."""

    def reset(self, instruction, demonstration):
        self.words = len(instruction)

    def act(self, observation):
        raise NotImplementedError


@functools.cache
def recorded():
    return record_expert(Seeing(), ROWS)


def small(picture):
    return np.asarray(picture, np.float64)[8::16, 8::16].ravel() / 255


def whole(rows):
    """Return a chunk of full length; the last row is repeated."""
    return np.concatenate([rows, np.repeat(rows[-1:], ROWS - len(rows), axis=0)])


class Learned(Seeing):
    """Learned the recorded episode by heart, from its pictures."""

    def __init__(self):
        moments = recorded().moments
        seen = np.stack([self.features(one.observation, front="front") for one in moments])
        motion = np.stack([whole(one.actions[:, :7] - one.still).ravel() for one in moments])
        self.mean, self.usual = seen.mean(axis=0), motion.mean(axis=0)
        self.weights = np.linalg.lstsq(seen - self.mean, motion - self.usual, rcond=None)[0]

    @staticmethod
    def features(observation, front):
        back = {"front": "wrist", "wrist": "front"}[front]
        return np.concatenate([small(observation[f"{one}_rgb"]) for one in (front, back)])

    def see(self, observation):
        return self.features(observation, front="front")

    def act(self, observation):
        joints = observation["joint_positions"].astype(float)
        motion = (self.see(observation) - self.mean) @ self.weights + self.usual
        motion += 1e-6 * self.words
        path = joints + motion.reshape(ROWS, 7)
        gripper = 1.0 if observation["gripper"][0] > 0.035 else -1.0
        return np.column_stack([path, np.full(ROWS, gripper)])


class Swapped(Learned):
    def see(self, observation):
        return self.features(observation, front="wrist")


class BlueFirst(Learned):
    def see(self, observation):
        reversed_ = {k: v[..., ::-1] for k, v in observation.items() if k.endswith("_rgb")}
        return self.features(reversed_, front="front")


def test_a_recorded_episode_is_what_the_expert_did():
    moments = recorded().moments
    assert len(moments) > 8
    for one, after in itertools.pairwise(moments):
        assert 1 <= len(one.actions) <= MAX_ROWS
        # The arm follows its targets.
        assert np.abs(one.actions[-1, :7] - after.still).max() < 0.1
        assert one.observation["front_rgb"].shape == (256, 256, 3)
    grips = {float(one.actions[0, -1]) for one in moments}
    assert grips == {-1.0, 1.0}


@pytest.mark.parametrize(
    ("kind", "expected"),
    [(Learned, set()), (Swapped, {"camera order"}), (BlueFirst, {"color order"})],
)
def test_conventions_are_told_apart_in_real_pictures(kind, expected):
    results = check_policy(kind(), record_expert=lambda *_: recorded())
    found = {one.check for one in results if one.verdict in (WARN, FAIL)} - {"video"}
    assert found == expected


class Posing:
    """Does what the expert did where the tool is; reads no pictures."""

    actions = "ee_pose"
    cameras = ()

    def reset(self, instruction, demonstration):
        self.words = len(instruction)

    def act(self, observation):
        here = observation["end_effector"]
        nearest = min(recorded_poses(), key=lambda one: np.abs(one.still - here).sum())
        rows = nearest.actions + 1e-6 * self.words
        rows[:, :6] += here - nearest.still
        return self.write(rows, here)

    def write(self, rows, here):
        return rows


class FromBase(Posing):
    def write(self, rows, here):
        return rows - [*ROBOT_BASE, 0, 0, 0, 0]


class Millimeters(Posing):
    def write(self, rows, here):
        return rows * [1000, 1000, 1000, 1, 1, 1, 1]


class Changing(Posing):
    def write(self, rows, here):
        return rows - [*here, 0]


@functools.cache
def recorded_poses():
    return record_expert(Posing(), 8).moments


def test_poses_of_the_expert_are_those_after_each_step():
    for one, after in itertools.pairwise(recorded_poses()):
        assert one.actions.shape[1] == 7
        assert np.allclose(one.actions[-1, :6], after.still)


@pytest.mark.parametrize(
    ("kind", "check", "words"),
    [
        (Posing, None, ""),
        (FromBase, "tool frame", "robot's base"),
        (Millimeters, "tool position", "in millimeters"),
        (Changing, "tool position", "changes of the pose"),
    ],
)
def test_conventions_of_poses_are_told_apart(kind, check, words):
    episode = ExpertEpisode("Go on.", {}, recorded_poses())
    results = check_policy(kind(), record_expert=lambda *_: episode)
    found = {one.check: one.message for one in results if one.verdict in (WARN, FAIL)}
    assert set(found) == ({check} if check else set())
    assert words in "".join(found.values())


def test_without_a_renderer_nothing_is_compared(monkeypatch):
    def refuse(*_, **__):
        raise RenderDeviceError("no device")

    monkeypatch.setattr("roboirg.envs.factory.make", refuse)
    (told,) = [
        one for one in check_policy("random", record_expert=record_expert) if one.check == "expert"
    ]
    assert told == ("expert", NOTE, "Not compared: no device.")
    assert PASS in {one.verdict for one in check_policy("random")}
