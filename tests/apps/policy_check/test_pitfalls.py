"""Every planted mistake is found by its name, and none in policies that are right."""

from collections import deque

import expert_world
import pytest
from expert_world import HONEST, Honest, OneByOne, record

from roboirg.apps.policy_check.policy_check import check_policy

PLANTED = []


def planted(check, words, verdict="warn"):
    """Declare the check that finds a mistake, words of its message, and the verdict."""

    def note(kind):
        PLANTED.append((kind, check, words, verdict))
        return kind

    return note


@planted("reset forgets", "belongs to the previous episode: a queue of actions", "fail")
class KeepsQueue(OneByOne):
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


@planted("gripper", "got -1 or less and 1 or more; change the sign")
class InvertsGripper(Honest):
    def gripper(self, observation):
        return -super().gripper(observation)


@planted("gripper", "Expected -1 whenever the expert holds a cube, got 0 to 0")
class GripperFromZero(Honest):
    def gripper(self, observation):
        return (super().gripper(observation) + 1) / 2


def results_of(kind, **options):
    found = check_policy(f"{kind.__module__}:{kind.__name__}", record_expert=record, **options)
    assert all(finding.message.endswith(".") for finding in found)
    return found


@pytest.mark.parametrize(
    ("kind", "check", "words", "verdict"), PLANTED, ids=[kind.__name__ for kind, *_ in PLANTED]
)
def test_a_planted_mistake_is_found_by_name(kind, check, words, verdict):
    results = results_of(kind)
    found = [finding for finding in results if finding.check == check]

    assert [finding.verdict for finding in found] == [verdict]
    assert words in found[0].message
    # And taken for no other.
    assert {finding.check for finding in results if finding.verdict in ("fail", "warn")} <= {check}


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("kind", HONEST, ids=lambda kind: kind.__name__)
def test_nothing_is_found_in_honest_policies(kind, seed):
    assert {finding.verdict for finding in results_of(kind, seed=seed)} <= {"pass", "note"}


def test_the_expert_s_error_is_told():
    (told,) = [finding for finding in results_of(Honest) if finding.check == "expert"]
    assert told.verdict == "pass"
    assert told.message == (
        "Distance from what an expert did at 20 moments: expected at most 0.0249 rad, half of that "
        "of holding still, got 0.000207."
    )

    (told,) = [
        finding for finding in results_of(expert_world.Untrained) if finding.check == "expert"
    ]
    assert told.verdict == "note"
