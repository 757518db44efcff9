"""How a name on the command line becomes a policy."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Mapping
from types import ModuleType
from typing import Any

from roboirg.errors import InvalidValueError, UnknownNameError
from roboirg.policies.base import Policy

BUILTIN: Mapping[str, str] = {
    "oracle": "roboirg.policies.oracle:OraclePolicy",
    "listener": "roboirg.policies.listeners:ListenerPolicy",
    "forgetful": "roboirg.policies.listeners:ForgetfulPolicy",
    "random": "roboirg.policies.random:RandomPolicy",
}


def load_policy_class(spec: str) -> type[Any]:
    """The class that a spec names: a built-in name, or ``package.module:Class``.

    Raises:
        UnknownNameError: it is neither.
        InvalidValueError: the module or the class cannot be imported, or is not a policy.
    """
    if spec not in BUILTIN and ":" not in spec:
        raise UnknownNameError("policy", spec, [*BUILTIN, "package.module:Class"])
    module_name, _, name = BUILTIN.get(spec, spec).partition(":")
    found = getattr(_module(spec, module_name), name, None)
    if not inspect.isclass(found):
        raise InvalidValueError(f"Policy {spec!r}: module {module_name} has no class {name!r}.")
    missing = [method for method in ("reset", "act") if not hasattr(found, method)]
    if missing:
        raise InvalidValueError(f"Policy {spec!r}: class {name} has no method {missing[0]}().")
    return found


def make_policy(spec: str, seed: int) -> Policy:
    """A policy from its spec.

    Args:
        spec: ``oracle``, ``listener``, ``forgetful``, ``random``, or ``package.module:Class``,
            which is called with ``seed=`` if it takes it, else without arguments.
        seed: of the policy's own random choices.

    Raises:
        UnknownNameError: there is no such built-in policy.
        InvalidValueError: the module or the class cannot be imported, or is not a policy.
    """
    policy_class = load_policy_class(spec)
    takes_seed = "seed" in inspect.signature(policy_class).parameters
    policy: Policy = policy_class(seed=seed) if takes_seed else policy_class()
    return policy


def _module(spec: str, name: str) -> ModuleType:
    try:
        return importlib.import_module(name)
    except Exception as error:
        raise InvalidValueError(
            f"Policy {spec!r}: module {name!r} cannot be imported "
            f"({type(error).__name__}: {error})."
        ) from error
