"""Open a policy once before a run, without running a user's code next to a world."""

from __future__ import annotations

import contextlib
from dataclasses import replace

from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import SCRIPTED, PolicyRef
from roboirg.evaluation.episode_errors import EpisodeError, EpisodeLostError
from roboirg.evaluation.hosting.host_pool import HostPool, HostSettings
from roboirg.evaluation.hosting.messages import Call
from roboirg.evaluation.hosting.policy_line import PolicyLine
from roboirg.policies.by_name.policy_kinds import make_follower
from roboirg.policies.contract.batch_policy import forget_batched
from roboirg.policies.opening import opened
from roboirg.policies.planners.hierarchical_policy import joint_version

LIMIT_S = 600.0


def open_policy(
    ref: PolicyRef, limit_s: float = LIMIT_S, settings: HostSettings | None = None
) -> PolicyRef:
    """Return a policy with its version and its needs.

    One of the user's is made in a process of its own and begins a synthetic episode, because it may
    set its version until its ``reset`` ends. Of ours, both are known.

    Args:
        ref: as it was named.
        limit_s: seconds that this may take.
        settings: of its process, which is on the first of the devices.

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
    hosted, settings = ref.hosted_part, settings or HostSettings()
    settings = replace(settings, devices=settings.devices[:1])
    try:
        with (
            HostPool(settings) as pool,
            contextlib.closing(PolicyLine(pool.connect(), hosted, limit_s)) as line,
        ):
            found = line.call(Call("describe", policy=hosted))
    except (EpisodeError, EpisodeLostError) as error:
        is_late = error.kind == "timeout"
        why = f"it was not opened within {limit_s:g} s" if is_late else error
        raise InvalidValueError(f"Policy {ref.spec!r} cannot be opened: {why}.") from error
    if found.error is not None:
        missing = found.error == "missing"
        raise (MissingDependencyError if missing else InvalidValueError)(found.message)
    needs, version = found.needs, found.version
    if ref.place == "split":
        hands = make_follower(SCRIPTED, 0)
        needs, version = PolicyNeeds.of(hands).merge(needs), joint_version(found, hands)
    # Whether it is privileged is not for its own process to say.
    return replace(ref, needs=needs, version=version, problem=found.message or None)
