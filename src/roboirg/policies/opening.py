"""Open a policy in this process: its version and needs are those of the object that plays."""

from __future__ import annotations

import contextlib
from dataclasses import replace

from roboirg.core.error_words import one_line
from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import UNKNOWN_VERSION, PolicyRef
from roboirg.policies.by_name.finding import declared_by, look_up, make_policy
from roboirg.policies.by_name.policy_kinds import CLASS, LIVE
from roboirg.policies.contract.base import Policy, close_policy
from roboirg.policies.contract.policy_version import read_version
from roboirg.policies.contract.synthetic_episodes import SyntheticEpisodes

FIRST_WORDS = "Put the red cube on the target."
VIDEO_STEPS = 4


def opened(ref: PolicyRef, seed: int = 0) -> PolicyRef:
    """Make a policy, begin a synthetic episode with it, and return what it then declares.

    A policy may set its version until its ``reset`` ends. If that raises, it is no error, as the
    synthetic words may be to blame: the version is then unknown, and `problem` says why.

    Raises:
        InvalidValueError: it cannot be made, or its version is no version; and as `make_policy`.
        MissingDependencyError: a library that it needs is not installed.
    """
    if ref.kind in (CLASS, LIVE):
        ref = look_up(ref)  # a class declares before any object of it is made
        policy, needs = _make(ref, seed)
    else:
        policy, needs = _make(ref, seed)
        ref = declared_by(ref, policy)
    try:
        problem = _problem_of_reset(policy, needs)
        if problem is not None:
            return replace(ref, version=UNKNOWN_VERSION, problem=problem)
        return replace(ref, needs=needs, version=read_version(policy) or ref.version)
    finally:
        with contextlib.suppress(Exception, SystemExit):  # how it ends does not count
            close_policy(policy)


def _make(ref: PolicyRef, seed: int) -> tuple[Policy, PolicyNeeds]:
    """Return a policy and its needs; whatever its code raises becomes an InvalidValueError."""
    try:
        policy = make_policy(ref, seed)
        return policy, PolicyNeeds.of(policy)
    except RoboIRGError:
        raise
    except (Exception, SystemExit) as error:
        raise InvalidValueError(
            f"Policy {ref.spec!r} cannot be made: {one_line(error)}."
        ) from error


def _problem_of_reset(policy: Policy, needs: PolicyNeeds) -> str | None:
    """Begin a synthetic episode; return in words what a policy's code raises, None if nothing."""
    try:
        episode = SyntheticEpisodes(needs).episode(FIRST_WORDS, VIDEO_STEPS)
        policy.reset(episode.instruction, episode.demonstration)
    except (Exception, SystemExit) as error:  # noqa: BLE001 - the policy's own
        return f"reset(): {one_line(error)}"
    return None
