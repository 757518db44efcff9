"""What a run must know of a policy before it plays, without running its code beside a world."""

from __future__ import annotations

from typing import Any, NamedTuple

from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.evaluation.hosting.host_process import MISSING
from roboirg.evaluation.hosting.policy_child import ChildLostError, PolicyChild
from roboirg.policies.loading import is_privileged, load_policy_class, policy_version
from roboirg.policies.planning.policy_specs import BUILDERS, SYSTEM
from roboirg.policies.planning.systems import find_system
from roboirg.policies.policy_classes import BUILTIN, CHECKPOINTS
from roboirg.policies.policy_urls import is_url, parse_query
from roboirg.util.plain_text import clip_text

_MAX_LENGTH = 2000


class PolicyDescription(NamedTuple):
    """What records say of a policy.

    Attributes:
        version: distinguishes versions of a policy of the same name.
        is_privileged: whether it reads the simulator's state.
    """

    version: str
    is_privileged: bool


_known: dict[str, PolicyDescription] = {}
"""Descriptions of this run's policies, so that error records need not load them again."""


def is_foreign(spec: str) -> bool:
    """Return whether a spec names code that does not come with this package or a protocol.

    Raises:
        InvalidValueError: it is a system that cannot be read.
    """
    kind, colon, rest = spec.partition(":")
    if spec in BUILTIN or is_url(spec) or not colon:
        return False
    if kind == SYSTEM:
        name, _, query = rest.partition("?")
        return is_foreign(find_system(name, parse_query(spec, query)).policy)
    return kind not in BUILDERS


def needs_host(spec: str) -> bool:
    """Return whether a policy gets a process of its own, unless it is privileged.

    Built-in policies and the clients of remote ones are our own code and run beside the world.

    Raises:
        InvalidValueError: it is a system that cannot be read.
    """
    return is_foreign(spec) or (is_url(spec) and spec.partition("://")[0] in CHECKPOINTS)


def describe_policy(spec: str, *, again: bool = False) -> PolicyDescription:
    """Return the description of a policy; foreign code is loaded in a process of its own.

    Args:
        spec: of the policy.
        again: whether to look again, because files may have changed.

    Raises:
        InvalidValueError: there is no such policy, or its module cannot be imported.
        MissingDependencyError: a library that it needs is not installed.
    """
    if again or spec not in _known:
        _known[spec] = _describe_apart(spec) if is_foreign(spec) else _describe_ours(spec)
    return _known[spec]


def describe_here(spec: str) -> PolicyDescription:
    """Return the description of a policy of this process; ``unknown`` if it cannot be loaded."""
    return PolicyDescription(policy_version(spec), is_privileged(spec))


def _describe_ours(spec: str) -> PolicyDescription:
    load_policy_class(spec)
    return describe_here(spec)


def _describe_apart(spec: str) -> PolicyDescription:
    child = PolicyChild()
    try:
        reply = child.exchange({"method": "describe", "calls": [{"spec": spec, "session": 0}]})
        (result,) = reply["results"]
        if "error" not in result:
            return _read(result["value"])
        kind, message, _ = map(str, result["error"])
    except (ChildLostError, AttributeError, KeyError, TypeError, ValueError) as error:
        raise InvalidValueError(f"Policy {spec!r} cannot be loaded: {error}.") from error
    finally:
        child.kill()
        child.stop()
    message = clip_text(message, _MAX_LENGTH)
    raise MissingDependencyError(message) if kind == MISSING else InvalidValueError(message)


def _read(value: Any) -> PolicyDescription:  # noqa: ANN401 - as a policy's process sent it
    version = clip_text(str(value["version"]), _MAX_LENGTH)
    return PolicyDescription(version, value["privileged"] is True)
