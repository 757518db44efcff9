"""Open a policy once before a run, without running a user's code next to a world."""

from __future__ import annotations

from dataclasses import replace

from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import SCRIPTED, PolicyRef
from roboirg.evaluation.episode_errors import EpisodeLostError
from roboirg.evaluation.hosting.messages import Call
from roboirg.evaluation.hosting.policy_child import PolicyChild
from roboirg.policies.by_name.policy_kinds import make_follower
from roboirg.policies.contract.batch_policy import forget_batched
from roboirg.policies.opening import opened
from roboirg.policies.planners.hierarchical_policy import joint_version
from roboirg.util.deadline_watch import DeadlineWatch

LIMIT_S = 600.0


def open_policy(ref: PolicyRef, limit_s: float = LIMIT_S, device: str | None = None) -> PolicyRef:
    """Return a policy with its version and its needs.

    One of the user's is made in a process of its own and begins a synthetic episode, because it may
    set its version until its ``reset`` ends. Of ours, both are known.

    Args:
        ref: as it was named.
        limit_s: seconds that this may take.
        device: its ``CUDA_VISIBLE_DEVICES``.

    Raises:
        InvalidValueError: there is no such policy, its module cannot be imported, or its version is
            no version.
        MissingDependencyError: a library that it needs is not installed.
    """
    if not ref.is_foreign:
        return ref
    forget_batched(ref.body)
    if ref.place == "python":
        return opened(ref)
    variables = {} if device is None else {"CUDA_VISIBLE_DEVICES": device}
    child = PolicyChild(variables)
    try:
        with DeadlineWatch(child.kill) as watch:
            watch.begin(limit_s)
            reply = child.exchange([Call("describe", policy=ref.hosted_part)])
    except EpisodeLostError as error:
        late = f"it was not opened within {limit_s:g} s"
        why = error if watch.acted_after is None else late
        raise InvalidValueError(f"Policy {ref.spec!r} cannot be opened: {why}.") from error
    finally:
        child.end()
    if not isinstance(reply, list) or len(reply) != 1:
        raise InvalidValueError(f"Policy {ref.spec!r} cannot be opened: it sent no description.")
    (found,) = reply
    if found.error is not None:
        missing = found.error == "missing"
        raise (MissingDependencyError if missing else InvalidValueError)(found.message)
    needs, version = found.needs, found.version
    if ref.place == "split":
        hands = make_follower(SCRIPTED, 0)
        needs, version = PolicyNeeds.of(hands).merge(needs), joint_version(found, hands)
    # Whether it is privileged is not for its own process to say.
    return replace(ref, needs=needs, version=version, problem=found.message or None)
