"""Policies: the contract, the built-in ones, and how to make one from its name."""

from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.by_name.loading import load_policy_class, make_policy
from roboirg.policies.contract.base import Policy, PrivilegedPolicy
from roboirg.policies.contract.play import play

__all__ = [
    "Demonstration",
    "Observation",
    "Policy",
    "PrivilegedPolicy",
    "load_policy_class",
    "make_policy",
    "play",
]
