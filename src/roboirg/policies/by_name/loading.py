"""Make policies from their names on the command line."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast
from urllib.parse import urlencode

from roboirg.core.errors import InvalidValueError
from roboirg.core.field_types import as_name
from roboirg.policies.builtin import BUILTIN
from roboirg.policies.by_name import policy_specs
from roboirg.policies.by_name.policy_classes import (
    CHECKPOINTS,
    find_class,
    make_from_class,
)
from roboirg.policies.by_name.policy_specs import PRIVILEGED
from roboirg.policies.by_name.systems import ELSEWHERE, HANDS, SCRIPTED, find_system
from roboirg.policies.contract.base import Policy
from roboirg.policies.contract.policy_needs import PolicyNeeds
from roboirg.policies.contract.policy_urls import is_url, parse_query
from roboirg.policies.planners import OF_MODELS
from roboirg.util.short_hash import short_hash

_MAX_VERSION_LENGTH = 200


def declares_privilege(spec: str) -> bool:
    """Return whether a spec declares its policy privileged."""
    return spec.startswith(PRIVILEGED)


def undeclared(spec: str) -> str:
    """Return a spec without the declaration that its policy is privileged."""
    return spec.removeprefix(PRIVILEGED)


def load_policy_class(spec: str) -> type[Any]:
    """Return the class of a built-in name, ``package.module:Class``, or a URL.

    For ``system:NAME`` and ``vlm-listener:PROVIDER`` (`roboirg.policies.by_name.policy_specs`)
    it is a factory with the attributes of such a class.

    Raises:
        UnknownNameError: the spec is none of them, or the URL has an unknown option.
        InvalidValueError: the module or class cannot be imported or is not a policy, it has
            ``attach`` and is not declared privileged, or the URL is malformed.
        MissingDependencyError: a library that the URL's scheme needs is not installed.
    """
    name = undeclared(spec)
    if name != spec and not is_foreign(name):
        raise InvalidValueError(
            f"Policy {name!r} is not a class of your own; leave out {PRIVILEGED!r}."
        )
    factory = policy_specs.find_policy_factory(name) if ":" in name else None
    # A factory has every attribute of a class that is read here.
    found = find_class(name) if factory is None else cast("type[Any]", factory)
    _refuse_undeclared(spec, found)
    return found


def make_policy(spec: str, seed: int) -> Policy:
    """Make a policy from its spec.

    Args:
        spec: a name in `BUILTIN`, such as ``oracle``; ``package.module:Class``,
            called with ``seed=`` if it takes it, else without arguments; or a URL.
        seed: of the policy's own random choices.

    Raises:
        UnknownNameError: there is no such built-in policy, scheme or option.
        InvalidValueError: the module or class cannot be imported or is not a policy, or the URL
            is malformed.
        MissingDependencyError: a library that the URL's scheme needs is not installed.
    """
    policy = make_from_class(undeclared(spec), load_policy_class(spec), seed)
    _refuse_undeclared(spec, policy)
    return policy


def policy_needs(spec: str) -> PolicyNeeds:
    """Return what the policy of a spec needs; it is not connected to anything."""
    return PolicyNeeds.of(_declaring(spec))


def is_foreign(spec: str) -> bool:
    """Return whether a spec names code that does not come with this package or a protocol."""
    spec = undeclared(spec)
    kind, colon, rest = spec.partition(":")
    if spec in BUILTIN or is_url(spec) or not colon:
        return False
    name, _, query = rest.partition("?")
    if kind == policy_specs.SYSTEM:
        policy = find_system(name, parse_query(spec, query)).policy
        return policy != SCRIPTED and is_foreign(policy)
    if kind == policy_specs.PLANNER:
        if ":" in name:
            return True
        hands = parse_query(spec, query).get(HANDS, SCRIPTED)
        return hands != SCRIPTED and is_foreign(hands)
    return not policy_specs.comes_with_us(kind)


def planner_alone(spec: str) -> str | None:
    """Return the spec of what gets a process of its own of a user's planner with scripted hands.

    The hands stay with the world. None for other policies, and for a planner declared privileged.
    """
    kind, _, rest = spec.partition(":")
    name, _, query = rest.partition("?")
    if kind != policy_specs.PLANNER or ":" not in name:
        return None
    options = parse_query(spec, query)
    if options.get(HANDS, SCRIPTED) != SCRIPTED:
        return None
    return f"{kind}:{name}?{urlencode({**options, HANDS: ELSEWHERE})}"


def model_asker(spec: str) -> str | None:
    """Return the kind of what asks a model for one of our policies: `LISTENER` or `PLANNER`.

    None if nothing does, or if it is code of others.
    """
    kind, _, rest = undeclared(spec).partition(":")
    name, _, query = rest.partition("?")
    if kind == policy_specs.SYSTEM:
        planner = find_system(name, parse_query(spec, query)).planner
        kind, name = policy_specs.PLANNER, "" if planner is None else str(planner.get("kind"))
    if kind == policy_specs.PLANNER:
        return kind if name in OF_MODELS else None
    return kind if kind == policy_specs.LISTENER else None


def needs_host(spec: str) -> bool:
    """Return whether a policy gets a process of its own.

    Built-in policies and the clients of remote ones are our own code and run next to the world, as
    do policies that the user declares privileged.
    """
    if declares_privilege(spec):
        return False
    if is_url(spec):
        return spec.partition("://")[0] in CHECKPOINTS
    name, colon, _ = spec.partition(":")
    kind = policy_specs.find_kind(name) if colon else None
    if kind is None or not kind.has_weights:
        return is_foreign(spec)
    # A learned planner with scripted hands acts on the world.
    return is_foreign(spec) or not hasattr(_declaring(spec), "attach")


def is_privileged(spec: str) -> bool:
    """Return whether a spec names a policy that may read the simulator's state.

    Only our own code is loaded to find out; the policies of others are what the spec declares.
    """
    try:
        if declares_privilege(spec) or is_foreign(spec):
            return declares_privilege(spec) or planner_alone(spec) is not None
        return hasattr(_declaring(spec), "attach")
    except InvalidValueError:
        return False


def policy_version(spec: str) -> str:
    """Return what distinguishes a policy from an earlier one of the same name.

    This is the class attribute ``version`` if it is a text or a number (say, the name of a
    checkpoint), else a fingerprint of the file that defines the class; ``built-in``; or ``unknown``
    if neither is found. For a URL it is the option ``version``: no server is asked.
    """
    name = undeclared(spec)
    if name in BUILTIN:
        return "built-in"
    try:
        policy_class = load_policy_class(spec)
        if is_url(name):
            version = getattr(policy_class(name), "version", "unknown")
        else:
            version = getattr(policy_class, "version", None)
        if isinstance(version, str | int | float):  # a property differs in each process
            return as_name(str(version))[:_MAX_VERSION_LENGTH]
        source = Path(inspect.getfile(policy_class)).read_bytes()
    except (InvalidValueError, OSError, TypeError):
        return "unknown"
    return short_hash(source)


def _declaring(spec: str) -> object:
    """Return what has the attributes of a spec's policies: a class, a factory, or a client."""
    policy_class, name = load_policy_class(spec), undeclared(spec)
    return policy_class(name) if is_url(name) else policy_class


def _refuse_undeclared(spec: str, policy: object) -> None:
    """Raise if a foreign policy or its class has ``attach``, which its spec does not declare."""
    # With scripted hands the whole has attach; the planner, which is all that is foreign, must not.
    part = policy if planner_alone(spec) is None else getattr(policy, "planner", None)
    if not declares_privilege(spec) and is_foreign(spec) and hasattr(part, "attach"):
        raise policy_specs.undeclared_error(spec)


def server_version(metadata: Mapping[str, Any]) -> str | None:
    """Return the version that a policy's server reported; None without a server or a version.

    Args:
        metadata: of the policy, or of a planner and a policy, after `reset`. Those of clients hold
            the address of the ``server`` and what it reported, such as its ``version``.
    """
    for told in (metadata, metadata.get("policy")):
        if isinstance(told, Mapping) and "server" in told:
            version = told.get("version")
            return None if version in (None, "", "unknown") else as_name(str(version))
    return None
