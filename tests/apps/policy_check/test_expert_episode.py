"""The simulator's expert as a reference: what is recorded, and what is found with it."""

import functools
import itertools

import numpy as np
import pytest

from roboirg.apps.policy_check.expert_episode import MAX_ROWS, ExpertEpisode, record_expert
from roboirg.apps.policy_check.policy_check import check_policy
from roboirg.core.errors import RenderDeviceError
from roboirg.core.observations import PICTURE_SIZE

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
    """The reference of a policy with pictures, with at most 16 actions at each moment."""
    return record_expert(Seeing(), ROWS)


def test_a_recorded_episode_is_what_the_expert_did():
    """An action has targets of seven joints (rad) and the gripper; `still` is where the arm is.

    After the actions of a moment the arm has followed the last target to 0.1 rad. The expert both
    opens the gripper (1) and closes it (-1) on its way.
    """
    moments = recorded().moments
    assert len(moments) > 8
    for moment, after in itertools.pairwise(moments):
        assert 1 <= len(moment.actions) <= MAX_ROWS
        joint_targets = moment.actions[-1, :7]
        assert np.abs(joint_targets - after.still).max() < 0.1
        assert moment.observation["front_rgb"].shape == (PICTURE_SIZE, PICTURE_SIZE, 3)

    grips = {float(moment.actions[0, -1]) for moment in moments}
    assert grips == {-1.0, 1.0}


class Posing:
    """Does what the expert did where the tool is; reads no pictures."""

    actions = "ee_pose"
    cameras = ()

    def reset(self, instruction, demonstration):
        self.words = len(instruction)

    def act(self, observation):
        here = observation["end_effector"]
        nearest = min(recorded_poses(), key=lambda moment: np.abs(moment.still - here).sum())
        rows = nearest.actions + 1e-6 * self.words
        rows[:, :6] += here - nearest.still
        return rows


@functools.cache
def recorded_poses():
    """The moments of the reference for a policy of poses, with at most 8 actions each."""
    return record_expert(Posing(), 8).moments


def test_poses_of_the_expert_are_those_after_each_step():
    """A pose has six numbers and the gripper; the last one is where the tool is at the next
    moment.
    """
    for moment, after in itertools.pairwise(recorded_poses()):
        assert moment.actions.shape in {(rows, 7) for rows in range(1, 9)}
        assert np.allclose(moment.actions[-1, :6], after.still)


def test_a_policy_that_does_what_the_expert_does_fits():
    """`Posing` repeats the expert's actions of the nearest moment, so the check `expert` passes.

    The bound in the message is half of the distance that holding still has.
    """
    episode = ExpertEpisode("Go on.", {}, recorded_poses())
    (told,) = [
        finding
        for finding in check_policy(Posing(), record_expert=lambda *_: episode)
        if finding.check == "expert"
    ]

    assert told.verdict == "pass"
    assert "expected at most 0.0109 m, half of that of holding still" in told.message


def test_without_a_renderer_nothing_is_compared(monkeypatch):
    """To make the environment fails as it does without a device: a note says so, no check fails.

    The note names the line of the error; other checks go on and pass.
    """

    def refuse(*_, **__):
        raise RenderDeviceError("no device")

    monkeypatch.setattr("roboirg.envs.factory.make", refuse)

    (told,) = [
        finding
        for finding in check_policy("random", record_expert=record_expert)
        if finding.check == "expert"
    ]

    assert told[:2] == ("expert", "note")
    assert told.message.startswith("Not compared: no device (test_expert_episode.py, line")
    assert "pass" in {finding.verdict for finding in check_policy("random")}
