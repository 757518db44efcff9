"""Specs for policies that are given as classes or objects, such as those of a notebook."""

from __future__ import annotations

import importlib
import sys
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from roboirg.policies.by_name.loading import undeclared
from roboirg.policies.by_name.policy_specs import PRIVILEGED

MODULE = "roboirg_local_policies"
"""Name of a module that exists in this process only; it holds what no other process can import."""


@dataclass(frozen=True)
class Privileged:
    """Declares that a policy may read the simulator's state: its ``attach`` gets the environment.

    Attributes:
        policy: a spec, class or object.
    """

    policy: str | type[Any] | object


def spec_of(policy: str | type[Any] | object) -> str:
    """Return the spec of a policy.

    Args:
        policy: a spec; a class; an object; or any of them as `Privileged`. An object plays every
            episode itself: nothing but its own ``reset`` clears what it remembers.

    Returns:
        A class that can be imported has a spec as on the command line. Anything else has one that
        is valid in this process.
    """
    if isinstance(policy, Privileged):
        return PRIVILEGED + spec_of(policy.policy)
    if isinstance(policy, str):
        return policy
    if isinstance(policy, type) and _can_be_imported(policy):
        return f"{policy.__module__}:{policy.__name__}"
    name = policy_name(policy)
    module = sys.modules.setdefault(MODULE, ModuleType(MODULE))
    setattr(module, name, policy if isinstance(policy, type) else _class_of(policy))
    return f"{MODULE}:{name}"


def is_local(spec: str) -> bool:
    """Return whether only this process knows the policy of a spec."""
    return undeclared(spec).startswith(f"{MODULE}:")


def policy_name(policy: str | type[Any] | object) -> str:
    """Return the name under which records list a policy: its spec, or the name of its class."""
    if isinstance(policy, Privileged):
        return spec_of(policy) if isinstance(policy.policy, str) else policy_name(policy.policy)
    if isinstance(policy, str):
        return policy
    return policy.__name__ if isinstance(policy, type) else type(policy).__name__


def _can_be_imported(policy: type[Any]) -> bool:
    if policy.__module__ == "__main__":
        return False
    try:
        module = importlib.import_module(policy.__module__)
    except ImportError:
        return False
    return getattr(module, policy.__name__, None) is policy


def _class_of(policy: object) -> type[Any]:
    """Return a class that has the object's attributes and always returns the object."""
    kind = type(policy)
    attributes = {**getattr(policy, "__dict__", {}), "__doc__": kind.__doc__}
    # Python calls no __init__ on what __new__ returns if it is of another class.
    attributes["__new__"] = lambda *_args, **_options: policy
    attributes["__init__"] = lambda _self: None
    return type(kind.__name__, (kind,), attributes)
