"""Policies: the contract, the built-in ones, and how a name becomes one."""

from roboirg.policies.base import Demonstration, Observation, Policy, PrivilegedPolicy
from roboirg.policies.loading import load_policy_class, make_policy
from roboirg.policies.playing import play

__all__ = [
    "Demonstration",
    "Observation",
    "Policy",
    "PrivilegedPolicy",
    "load_policy_class",
    "make_policy",
    "play",
]
