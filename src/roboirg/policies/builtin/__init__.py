"""Built-in policies: oracle, language baselines and random actions."""

from __future__ import annotations

from collections.abc import Mapping

BUILTIN: Mapping[str, str] = {
    "oracle": "roboirg.policies.builtin.oracle_policy:OraclePolicy",
    "listener": "roboirg.policies.builtin.listeners:ListenerPolicy",
    "forgetful": "roboirg.policies.builtin.listeners:ForgetfulPolicy",
    "first-mention": "roboirg.policies.builtin.listeners:FirstMentionPolicy",
    "last-mention": "roboirg.policies.builtin.listeners:LastMentionPolicy",
    "elimination": "roboirg.policies.builtin.listeners:EliminationPolicy",
    "surface": "roboirg.policies.builtin.listeners:SurfacePolicy",
    "habit": "roboirg.policies.builtin.oracle_policy:HabitPolicy",
    "previous-goal": "roboirg.policies.builtin.oracle_policy:PreviousGoalPolicy",
    "random": "roboirg.policies.builtin.random_policy:RandomPolicy",
}
"""Classes of the built-in policies, by name."""
