"""What a package needs to add a kind of policy."""

from __future__ import annotations

from roboirg.core.observations import Demonstration, Observation
from roboirg.envs.environment import RoboIRGEnv
from roboirg.policies.builtin.scripted import ScriptedPolicy
from roboirg.policies.by_name.policy_kinds import PolicyKind, make_follower
from roboirg.policies.contract.goal_naming import SaidAndShown
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy
from roboirg.policies.planners.planner import Planner

__all__ = [
    "Demonstration",
    "Observation",
    "PolicyKind",
    "RoboIRGEnv",
    "SaidAndShown",
    "ScriptedPolicy",
    "followed",
]


def followed(planner: Planner, hands: str, seed: int, name: str) -> HierarchicalPolicy:
    """Return a policy of a planner and what follows its subgoals.

    Args:
        planner: names the subgoals.
        hands: ``scripted``, or a policy as on the command line.
        seed: of the hands.
        name: of the whole, for messages.
    """
    return HierarchicalPolicy(planner, make_follower(hands, seed), name)
