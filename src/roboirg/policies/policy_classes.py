"""Policies that a single class makes: built in, by import path, or by address."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Mapping
from types import ModuleType
from typing import Any

from roboirg.core.errors import InvalidValueError, MissingDependencyError, UnknownNameError
from roboirg.policies.base import Policy
from roboirg.policies.policy_urls import is_url
from roboirg.policies.requirements import WISHES

BUILTIN: Mapping[str, str] = {
    "oracle": "roboirg.policies.builtin.oracle_policy:OraclePolicy",
    "listener": "roboirg.policies.builtin.listeners:ListenerPolicy",
    "forgetful": "roboirg.policies.builtin.listeners:ForgetfulPolicy",
    "random": "roboirg.policies.builtin.random_policy:RandomPolicy",
}

SCHEMES: Mapping[str, str] = {
    "openpi": "roboirg.policies.protocols.openpi:OpenpiPolicy",
    "mme-vla": "roboirg.policies.protocols.mme_vla:MmeVlaPolicy",
    "challenge": "roboirg.policies.protocols.challenge:ChallengePolicy",
    "challenge+http": "roboirg.policies.protocols.challenge:ChallengeHttpPolicy",
    "lerobot": "roboirg.policies.lerobot_policy:LeRobotPolicy",
}
"""Policies named by a URL, by its scheme: classes made with ``(url, seed=)``, without a network."""


def find_class(spec: str) -> type[Any]:
    """The class that a spec names: a built-in name, ``package.module:Class``, or a URL.

    Raises:
        UnknownNameError: it is none of them, or the URL gives an option that there is not.
        InvalidValueError: the module or the class cannot be imported, or is not a policy; or
            the URL is malformed.
    """
    if is_url(spec):
        policy_class = _url_class(spec)
        _check_wishes(spec, policy_class(spec))
        return policy_class
    if spec not in BUILTIN and ":" not in spec:
        raise UnknownNameError("policy", spec, [*BUILTIN, "package.module:Class", *_examples()])
    module_name, _, name = BUILTIN.get(spec, spec).partition(":")
    module = _module(spec, module_name)
    if not hasattr(module, name):
        raise InvalidValueError(f"Policy {spec!r}: module {module_name} has no class {name!r}.")
    found = getattr(module, name)
    if not inspect.isclass(found):
        raise InvalidValueError(
            f"Policy {spec!r}: {name!r} in module {module_name} is no class but of type "
            f"{type(found).__name__}."
        )
    _check_class(spec, found)
    return found


def make_from_class(spec: str, policy_class: type[Any], seed: int) -> Policy:
    """A policy of a class that was found by a spec.

    Args:
        spec: an address is given to the constructor.
        policy_class: is called with ``seed=`` if it takes it, else without.
        seed: of the policy's own random choices.
    """
    if is_url(spec):
        remote: Policy = policy_class(spec, seed=seed)
        return remote
    policy: Policy = policy_class(seed=seed) if "seed" in _takes(policy_class) else policy_class()
    return policy


def _check_class(spec: str, policy_class: type[Any]) -> None:
    """Complain of what would otherwise end every episode."""
    name = policy_class.__name__
    for method in ("reset", "act"):
        if not hasattr(policy_class, method):
            raise InvalidValueError(f"Policy {spec!r}: class {name} has no method {method}().")
        if not callable(getattr(policy_class, method)):
            raise InvalidValueError(f"Policy {spec!r}: {method} of class {name} is no method.")
    if inspect.isabstract(policy_class):
        lacking = sorted(policy_class.__abstractmethods__)
        raise InvalidValueError(
            f"Policy {spec!r}: class {name} is abstract; it lacks {', '.join(lacking)}."
        )
    for parameter in _takes(policy_class).values():
        optional = parameter.default is not parameter.empty or parameter.kind in (
            parameter.VAR_POSITIONAL,
            parameter.VAR_KEYWORD,
        )
        if not optional and parameter.name != "seed":
            raise InvalidValueError(
                f"Policy {spec!r}: {name}() is called with seed= at most, but needs "
                f"{parameter.name!r}; give it a default."
            )
    _check_wishes(spec, policy_class)


def _check_wishes(spec: str, policy: object) -> None:
    """Complain of what a class, or a policy, asks for."""
    for attribute, wanted in WISHES.items():
        # What a property of a class says is known when there is an object.
        if not inspect.isclass(policy) or not hasattr(
            inspect.getattr_static(policy, attribute, ()), "__get__"
        ):
            try:
                wanted(policy)
            except InvalidValueError as error:
                raise InvalidValueError(f"Policy {spec!r}: {error}") from error


def _url_class(spec: str) -> type[Any]:
    """The class of a URL's scheme."""
    scheme = spec.partition("://")[0]
    if scheme not in SCHEMES:
        raise UnknownNameError("policy scheme", scheme, SCHEMES)
    module_name, _, name = SCHEMES[scheme].partition(":")
    found: type[Any] = getattr(_module(spec, module_name), name)
    return found


def _examples() -> list[str]:
    return [*(f"{scheme}://…" for scheme in SCHEMES), "system:NAME", "vlm-listener:PROVIDER"]


def _takes(policy_class: type[Any]) -> Mapping[str, inspect.Parameter]:
    try:
        return inspect.signature(policy_class).parameters
    except (TypeError, ValueError):  # a class written in C need not tell
        return {}


def _module(spec: str, name: str) -> ModuleType:
    try:
        return importlib.import_module(name)
    except MissingDependencyError:
        raise
    except (Exception, SystemExit) as error:
        words = " ".join(f"{type(error).__name__}: {error}".split())
        raise InvalidValueError(
            f"Policy {spec!r}: module {name!r} cannot be imported ({words})."
        ) from error
