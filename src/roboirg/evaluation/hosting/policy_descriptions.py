"""What a run must know of a policy before it plays, without running its code next to a world."""

from __future__ import annotations

from typing import NamedTuple

from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.evaluation.episode_errors import EpisodeLostError
from roboirg.evaluation.hosting.messages import Call
from roboirg.evaluation.hosting.policy_child import PolicyChild
from roboirg.policies.by_name.loading import (
    is_foreign,
    is_privileged,
    load_policy_class,
    planner_alone,
    policy_needs,
    policy_version,
)
from roboirg.policies.by_name.systems import SCRIPTED, make_hands
from roboirg.policies.contract.policy_needs import PolicyNeeds
from roboirg.policies.planners.hierarchical_policy import joint_version
from roboirg.util.deadline_watch import DeadlineWatch

LIMIT_S = 600.0
"""How long a policy's module may take to be imported."""


class PolicyDescription(NamedTuple):
    """What records say of a policy.

    Attributes:
        version: distinguishes versions of a policy of the same name.
        is_privileged: whether it reads the simulator's state.
        needs: what it declares, as far as its class shows.
    """

    version: str
    is_privileged: bool
    needs: PolicyNeeds = PolicyNeeds()


_known: dict[str, PolicyDescription] = {}
"""Descriptions of this run's policies, so that error records need not load them again."""


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


def know_policy(spec: str) -> None:
    """Describe a policy in this process, as one that no other process can import."""
    _known[spec] = _describe_ours(spec)


def describe_here(spec: str) -> PolicyDescription:
    """Return the description of a policy of this process; ``unknown`` if it cannot be loaded."""
    try:
        needs = policy_needs(spec)
    except InvalidValueError:
        needs = PolicyNeeds()
    return PolicyDescription(policy_version(spec), is_privileged(spec), needs)


def _describe_ours(spec: str) -> PolicyDescription:
    load_policy_class(spec)
    return describe_here(spec)


def _describe_apart(spec: str) -> PolicyDescription:
    child = PolicyChild()
    planner = planner_alone(spec)
    try:
        with DeadlineWatch(child.kill) as watch:
            watch.begin(LIMIT_S)
            reply = child.exchange([Call("describe", spec=planner or spec)])
    except EpisodeLostError as error:
        late = f"its module was not imported within {LIMIT_S:g} s"
        why = error if watch.acted_after is None else late
        raise InvalidValueError(f"Policy {spec!r} cannot be loaded: {why}.") from error
    finally:
        child.end()
    if not isinstance(reply, list) or len(reply) != 1:
        raise InvalidValueError(f"Policy {spec!r} cannot be loaded: it sent no description.")
    (found,) = reply
    if found.error is not None:
        missing = found.error == "missing"
        raise (MissingDependencyError if missing else InvalidValueError)(found.message)
    # Whether it is privileged is not for its own process to say.
    if planner is not None:
        hands = make_hands(SCRIPTED, 0)
        needs = PolicyNeeds.of(hands).merge(found.needs)
        return PolicyDescription(joint_version(found, hands), is_privileged(spec), needs)
    return PolicyDescription(found.version, is_privileged(spec), found.needs)
