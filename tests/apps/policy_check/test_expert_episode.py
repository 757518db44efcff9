"""The simulator's expert as a reference: what is recorded, and what is found with it."""

import functools
import itertools

import numpy as np
import pytest

from roboirg.apps.policy_check.expert_episode import ExpertEpisode, record_expert
from roboirg.apps.policy_check.policy_check import check_policy
from roboirg.core.errors import RenderDeviceError

pytestmark = pytest.mark.sim


class Seeing:
    """Asks for the pictures of both cameras."""

    def reset(self, instruction, demonstration):
        self.words = len(instruction)

    def act(self, observation):
        raise NotImplementedError


@pytest.fixture(scope="module")
def expert_moments():
    """What the simulator's expert does in an episode, for a policy with pictures.

    A moment is where such a policy is asked: what it sees, and at most 16 actions of the expert,
    each of seven joint targets (rad) and the gripper (1 opens, -1 closes).
    """
    return record_expert(Seeing(), 16).moments


def test_a_recorded_moment_has_a_picture_and_1_to_16_actions(expert_moments):
    """An episode of PickXtimes is longer than eight times 16 actions."""
    assert len(expert_moments) > 8
    for moment in expert_moments:
        assert 1 <= len(moment.actions) <= 16
        assert moment.observation["front_rgb"].shape == (256, 256, 3)


def test_the_arm_follows_the_recorded_actions_of_each_moment(expert_moments):
    """`still` has the angles of the joints at a moment.

    At the next moment they are less than 0.1 rad (6 degrees) from the last target; the controller
    lags behind by a few hundredths.
    """
    for moment, next_moment in itertools.pairwise(expert_moments):
        last_target = moment.actions[-1, :7]
        assert np.abs(last_target - next_moment.still).max() < 0.1


def test_the_recorded_expert_opens_and_closes_the_gripper(expert_moments):
    """The last number of an action is the gripper's: 1 opens it and -1 closes it."""
    gripper_actions = {float(moment.actions[0, -1]) for moment in expert_moments}

    assert gripper_actions == {-1.0, 1.0}


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


def expert_finding(policy, record_expert):
    """Return the finding of `check_policy` that compares a policy with the recorded expert."""
    findings = check_policy(policy, record_expert=record_expert)
    (found,) = [finding for finding in findings if finding.check == "expert"]
    return found


def test_a_policy_that_does_what_the_expert_does_fits():
    """`Posing` repeats the expert's actions of the nearest moment, so the check `expert` passes.

    The bound in the message is half of the distance that holding still has.
    """
    episode = ExpertEpisode("Go on.", {}, recorded_poses())

    told = expert_finding(Posing(), lambda *_: episode)

    assert told.verdict == "pass"
    assert "expected at most 0.0109 m, half of that of holding still" in told.message


def test_without_a_renderer_nothing_is_compared_with_the_expert(monkeypatch):
    """To record the expert, an environment is made. Here that fails as on a machine without a
    device for rendering: a note, which is no failure, says so with the line of the error.
    """

    def refuse(*_, **__):
        raise RenderDeviceError("no device")

    monkeypatch.setattr("roboirg.envs.factory.make", refuse)

    told = expert_finding("random", record_expert)

    assert told.verdict == "note"
    assert told.message.startswith("Not compared: no device (test_expert_episode.py, line")


def test_without_a_renderer_other_checks_of_a_policy_pass(monkeypatch):
    """They need no environment; here none can be made."""
    monkeypatch.delattr("roboirg.envs.factory.make")

    assert "pass" in {finding.verdict for finding in check_policy("random")}
