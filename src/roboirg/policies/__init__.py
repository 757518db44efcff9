"""Policies: the contract, the built-in ones, and how to make one from its name."""

from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.by_name.finding import find_policy, make_policy
from roboirg.policies.contract.base import Policy, PrivilegedPolicy
from roboirg.policies.contract.play import play

__all__ = [
    "Demonstration",
    "Observation",
    "Policy",
    "PrivilegedPolicy",
    "find_policy",
    "make_policy",
    "play",
]
