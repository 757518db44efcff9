"""Open a policy once before a run, without running a user's code next to a world."""

from __future__ import annotations

import contextlib
from dataclasses import replace

from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import RESOLVE, SCRIPTED, PolicyRef
from roboirg.policies.by_name.finding import behind_rewriter, read_policy, rewriting_in
from roboirg.policies.by_name.policy_kinds import make_follower, namer_of
from roboirg.policies.contract.batch_policy import forget_batched
from roboirg.policies.opening import opened
from roboirg.policies.planners.hierarchical_policy import joint_version
from roboirg.runs.episode_errors import EpisodeError, EpisodeLostError
from roboirg.runs.hosting.host_pool import HostPool, HostSettings
from roboirg.runs.hosting.messages import Call, Outcome
from roboirg.runs.hosting.policy_line import PolicyLine

LIMIT_S = 600.0


def open_policy(
    ref: PolicyRef, limit_s: float = LIMIT_S, settings: HostSettings | None = None
) -> PolicyRef:
    """Return a policy's reference with the version and the needs that the policy declares.

    A policy of the user's is made in a process of its own and begins a synthetic episode, because
    it may set its version until its ``reset`` ends. Those of roboirg are returned as they are.

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
    if ref.kind == RESOLVE:
        rewriting = rewriting_in(ref)
        follower = open_policy(read_policy(rewriting.policy), limit_s, settings)
        return behind_rewriter(ref, namer_of(rewriting, 0), follower)
    forget_batched(ref.body)
    if ref.place == "python":
        return opened(ref)

    outcome = _describe(ref, limit_s, settings or HostSettings())
    if outcome.error == "missing":
        raise MissingDependencyError(outcome.message)
    if outcome.error is not None:
        raise InvalidValueError(outcome.message)
    # Whether it is privileged is not for its own process to say.
    described = replace(
        ref, needs=outcome.needs, version=outcome.version, problem=outcome.message or None
    )
    if ref.place != "split":
        return described
    # A planner in its process; the scripted expert follows it in this one.
    hands = make_follower(SCRIPTED, 0)
    return replace(
        described,
        needs=PolicyNeeds.of(hands).merge(outcome.needs),
        version=joint_version(outcome, hands),
    )


def _describe(ref: PolicyRef, limit_s: float, settings: HostSettings) -> Outcome:
    """Return what a policy declares, opened in a new process of its own that ends here.

    Args:
        ref: the policy.
        limit_s: seconds that this may take.
        settings: of the process, which is on the first of the devices.

    Raises:
        InvalidValueError: the process is lost, or takes too long.
    """
    hosted = ref.hosted_part
    settings = replace(settings, devices=settings.devices[:1])
    try:
        with (
            HostPool(settings) as pool,
            contextlib.closing(PolicyLine(pool.connect(), hosted, limit_s)) as line,
        ):
            return line.call(Call("describe", policy=hosted))
    except (EpisodeError, EpisodeLostError) as error:
        reason = str(error)
        if error.kind == "timeout":
            reason = f"it was not opened within {limit_s:g} s"
        raise InvalidValueError(f"Policy {ref.spec!r} cannot be opened: {reason}.") from error
