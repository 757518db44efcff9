"""The simulator's expert as a reference: what is recorded, and what is found with it."""

import functools
import itertools

import numpy as np
import pytest

from roboirg.apps.policy_check.expert_episode import MAX_ROWS, record_expert
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
    return record_expert(Seeing(), ROWS)


def test_a_recorded_episode_is_what_the_expert_did():
    moments = recorded().moments
    assert len(moments) > 8
    for moment, after in itertools.pairwise(moments):
        assert 1 <= len(moment.actions) <= MAX_ROWS
        # The arm follows its targets.
        assert np.abs(moment.actions[-1, :7] - after.still).max() < 0.1
        assert moment.observation["front_rgb"].shape == (PICTURE_SIZE, PICTURE_SIZE, 3)

    grips = {float(moment.actions[0, -1]) for moment in moments}
    assert grips == {-1.0, 1.0}


class Following(Seeing):
    """Does what the expert did where the joints are."""

    def act(self, observation):
        here = observation["joint_positions"]
        nearest = min(recorded().moments, key=lambda moment: np.abs(moment.still - here).sum())
        rows = nearest.actions + 1e-6 * self.words
        rows[:, :7] += here - nearest.still
        return rows


def test_a_policy_that_does_what_the_expert_does_fits():
    (told,) = [
        finding
        for finding in check_policy(Following(), record_expert=lambda *_: recorded())
        if finding.check == "expert"
    ]

    assert told.verdict == "pass"
    assert "rad, half of that of holding still" in told.message


def test_without_a_renderer_nothing_is_compared(monkeypatch):
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
