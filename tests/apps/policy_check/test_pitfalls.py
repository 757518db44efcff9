"""Every planted mistake is found by its name, and none in policies that are right."""

from collections import deque

import pytest
from expert_world import HONEST, Honest, OneByOne, Untrained, record

from roboirg.apps.policy_check.policy_check import check_policy


class KeepsQueue(OneByOne):
    """Its queue of actions outlives its reset: the next episode begins with the last one's."""

    def __init__(self, seed=0):
        super().__init__(seed)
        self.kept = deque()

    def reset(self, instruction, demonstration):
        super().reset(instruction, demonstration)
        self.queue = self.kept

    def act(self, observation):
        if not self.queue:
            self.queue.extend(Honest.act(self, observation)[:5])
        return self.queue.popleft()


class InvertsGripper(Honest):
    """Its gripper is -1 when open and 1 when closed, the other way around."""

    def gripper(self, observation):
        return -super().gripper(observation)


class GripperFromZero(Honest):
    """Its gripper is 0 when closed and 1 when open."""

    def gripper(self, observation):
        return (super().gripper(observation) + 1) / 2


def results_of(kind, **options):
    """Check a policy class next to the made-up expert of expert_world.py."""
    return check_policy(f"{kind.__module__}:{kind.__name__}", record_expert=record, **options)


@pytest.mark.parametrize(
    ("kind", "check", "verdict", "words"),
    [
        (
            KeepsQueue,
            "reset forgets",
            "fail",
            "belongs to the previous episode: a queue of actions",
        ),
        (
            InvertsGripper,
            "gripper",
            "warn",
            "got -1 or less and 1 or more; change the sign",
        ),
        (
            GripperFromZero,
            "gripper",
            "warn",
            "Expected -1 whenever the expert holds a cube, got 0 to 0",
        ),
    ],
)
def test_a_planted_mistake_is_found_by_its_check_and_by_no_other(kind, check, verdict, words):
    """Each class has one mistake, which its name says; no other check warns or fails."""
    results = results_of(kind)

    complaints = [result for result in results if result.verdict in ("fail", "warn")]

    assert [(result.check, result.verdict) for result in complaints] == [(check, verdict)]
    assert words in complaints[0].message


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("kind", HONEST)
def test_nothing_is_found_in_honest_policies(kind, seed):
    """`HONEST` are policies without a mistake that act in different ways; checks pass or note."""
    assert {result.verdict for result in results_of(kind, seed=seed)} <= {"pass", "note"}


def test_the_distance_from_the_expert_passes_if_it_is_below_half_of_holding_still():
    """The honest policy does nearly what the made-up expert did, so 0.0002 is far below
    0.0249 rad.
    """
    (result,) = [result for result in results_of(Honest) if result.check == "expert"]

    assert result.verdict == "pass"
    assert result.message == (
        "Distance from what an expert did at 20 moments: expected at most 0.0249 rad, half of that "
        "of holding still, got 0.000207."
    )


def test_the_distance_of_an_untrained_policy_from_the_expert_is_noted():
    """It is farther than half of holding still, which is a note and no failure."""
    (result,) = [result for result in results_of(Untrained) if result.check == "expert"]
    assert result.verdict == "note"
