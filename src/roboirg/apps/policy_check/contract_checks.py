"""Checks of the contract: what `reset` and `act` take, give and remember."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import numpy as np

from roboirg.apps.policy_check.check_result import (
    CheckAbortedError,
    CheckResult,
    describe_error,
    ending_checks,
)
from roboirg.apps.policy_check.policy_player import (
    CALLS,
    PolicyPlayer,
    SyntheticRollout,
    are_equal,
    describe_difference,
)
from roboirg.core.actions import ActionSpace
from roboirg.core.errors import MissingDependencyError, RoboIRGError
from roboirg.core.plain_text import counted, verb_for
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import UNKNOWN_VERSION
from roboirg.policies.by_name.finding import look_up, read_policy
from roboirg.policies.contract.batch_policy import BatchedEpisode
from roboirg.policies.contract.policy_calls import policy_metadata, policy_subgoal, policy_usage
from roboirg.policies.contract.policy_version import read_version
from roboirg.policies.prompt_length.tokenizer_file import prompt_limit


def check_loading(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that the policy can be made and needs no simulator.

    Raises:
        CheckAbortedError: it cannot be checked any further.
        MissingDependencyError: a library that it needs is not installed.
    """
    try:
        policy = player.make_fresh()
        missing = [name for name in ("reset", "act") if not callable(getattr(policy, name, None))]
    except MissingDependencyError:
        raise
    except (Exception, SystemExit) as error:  # the policy's own code runs here
        raise CheckAbortedError("loads", "fail", describe_error(error)) from error
    if missing:
        words = f"Expected reset() and act(), got no {missing[0]}()."
        raise CheckAbortedError("loads", "fail", words)
    if hasattr(policy, "attach"):
        raise CheckAbortedError(
            "loads", "note", "It is privileged: it needs a simulator, which is not available here."
        )
    name = player.source if isinstance(policy, BatchedEpisode) else type(policy).__name__
    yield CheckResult("loads", "pass", f"{name} was made with seed {player.seed}.")


def check_requirements(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Read what the policy requires of an environment, and keep it for the later checks.

    Sets ``player.needs``, on which all later checks rely.
    """
    try:
        needs = PolicyNeeds.of(player.policy)
        prompt_limit(needs)  # raises if the tokenizer cannot be read
    except RoboIRGError as error:
        raise CheckAbortedError("requirements", "fail", str(error)) from error
    player.needs = needs
    words = (
        f"Actions {needs.actions}, cameras {', '.join(needs.cameras) or 'none'}, demonstration "
        f"frames {needs.demonstration_frames}, observations every {needs.observe_every or 'chunk'}"
    )
    if needs.depth:
        words += ", depth"
    if needs.calibration:
        words += ", calibration"
    yield CheckResult("requirements", "pass", f"{words}.")


def check_version(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that records distinguish the policy from an earlier one of the same name.

    They do by the policy's own ``version``, or else by a fingerprint of the file that defines it.
    """
    source = player.source
    # First a reset, as a policy may set its version until that ends.
    with ending_checks("version", "reset(): "):
        episode = copy.deepcopy(player.without_video)
        player.policy.reset(episode.instruction, episode.demonstration)
    with ending_checks("version"):
        version = read_version(player.policy)
    fingerprint = UNKNOWN_VERSION
    if isinstance(source, str):
        fingerprint = look_up(read_policy(source)).version
    if version is not None and version != UNKNOWN_VERSION:
        yield CheckResult("version", "pass", f"Records name the version that it has: {version}.")
    elif fingerprint != UNKNOWN_VERSION:
        yield CheckResult(
            "version",
            "pass",
            f"It has no version, so records name a fingerprint of its file: {fingerprint}. A "
            "policy that loads a checkpoint needs the checkpoint's name as its version.",
        )
    else:
        yield CheckResult(
            "version",
            "note",
            "It is unknown, so records of a changed policy look the same; set the attribute "
            "version, or version=… in the URL of a server.",
        )


def check_acting(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check shapes, types and ranges of actions, without a video and after one."""
    yield from _describe_actions("without a video", player.space, player.first_rollout)
    yield from _describe_actions("with a video", player.space, player.expected)


def _describe_actions(
    when: str, space: ActionSpace, rollout: SyntheticRollout
) -> Iterator[CheckResult]:
    """Yield the shape of a policy's actions, and how many have a number outside the usual range.

    Args:
        when: which of the episodes was played, for the names of the results.
        space: of the actions.
        rollout: what the policy returned.
    """
    sizes = [len(chunk) for chunk in rollout.chunks]
    yield CheckResult(
        f"acts {when}",
        "pass",
        f"Chunks of {', '.join(map(str, sizes))} actions of {space.size} numbers, "
        f"{rollout.dtype}, all finite.",
    )
    actions = np.concatenate(rollout.chunks)
    excess = np.maximum(space.low - actions, actions - space.high)  # above 0 outside the range
    outside = int((excess > 0).any(axis=1).sum())
    if outside:
        row, column = np.unravel_index(excess.argmax(), excess.shape)
        have = verb_for(outside, "have")
        yield CheckResult(
            f"range {when}",
            "note",
            f"{outside} of {counted(len(actions), 'action')} {have} a number outside the usual "
            f"range of {space.name}; farthest is value {column} of action {row}: expected "
            f"{space.low[column]:.3g} to {space.high[column]:.3g}, got "
            f"{actions[row, column]:.3g}. The robot executes them as well as it can.",
        )


def check_reports(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check what records take from the policy besides its actions: metadata, subgoal and costs.

    The policy has just played, as some of them exist only after `reset` or `act`.
    """
    policy = player.policy
    source = player.source
    is_ours = isinstance(source, str) and not read_policy(source).is_foreign
    try:
        metadata = policy_metadata(policy, is_ours=is_ours)
        policy_subgoal(policy)  # raises if it is malformed, and so do the costs
        policy_usage(policy)
    except (Exception, SystemExit) as error:  # noqa: BLE001 - a property may raise anything
        yield CheckResult("reports", "fail", describe_error(error))
        return
    if metadata:
        yield CheckResult("reports", "pass", f"Records hold its {', '.join(metadata)}.")


def check_determinism(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that two equal episodes have equal actions.

    Sets ``player.repeatable``, on which `check_reset` relies.
    """
    again = player.play("deterministic", player.with_video)
    player.repeatable = are_equal(player.expected, again)
    if player.repeatable:
        yield CheckResult(
            "deterministic", "pass", "Two equal episodes have the same actions, bit for bit."
        )
    elif getattr(player.policy, "deterministic", True):
        difference = describe_difference(player.expected, again)
        yield CheckResult(
            "deterministic",
            "fail",
            f"Two equal episodes differ: {difference}; if that is intended, set "
            "deterministic = False.",
        )
    else:
        yield CheckResult("deterministic", "note", "Equal episodes differ, as the policy declares.")


def check_reset(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that an episode does not depend on the one before it.

    The same object plays an episode without a video, then the one with a video whose answers of a
    fresh policy are known. `check_determinism` must have run.
    """
    name = "reset forgets"
    expected = player.expected
    if not (player.repeatable and getattr(player.policy, "deterministic", True)):
        yield CheckResult(name, "note", "Not checked: the policy is not deterministic.")
        return
    player.play(name, player.without_video)
    after = player.play(name, player.with_video, fresh=False)
    if are_equal(expected, after):
        yield CheckResult(name, "pass", "An episode does not depend on the one before it.")
        return
    # The usual fault is a queue of actions that outlives its episode. Then the first answer after
    # reset() is one that a longer first episode would have had; so that is played, twice as long.
    before = player.play(name, player.without_video, calls=2 * CALLS).chunks
    if _has(before, after.chunks[0]) and not _has(before, expected.chunks[0]):
        message = (
            f"The first answer after reset(), {describe_difference(expected, after)}, belongs to "
            "the previous episode: a queue of actions outlives the episode; empty it in reset()."
        )
    else:
        message = (
            "A second episode with the same object differs from the same episode played first: "
            f"{describe_difference(expected, after)}."
        )
    yield CheckResult(name, "fail", message)


def _has(chunks: list[Any], chunk: Any) -> bool:  # noqa: ANN401 - arrays
    """Return whether a chunk is one of several."""
    return any(np.array_equal(other, chunk) for other in chunks)
