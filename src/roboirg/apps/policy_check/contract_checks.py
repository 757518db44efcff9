"""Checks of the contract: what `reset`, `act` and `hear` take, give and remember."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import numpy as np

from roboirg.apps.policy_check.check_result import (
    FAIL,
    NOTE,
    PASS,
    CheckAbortedError,
    CheckResult,
    describe_error,
)
from roboirg.apps.policy_check.picture_formats import find_working_format
from roboirg.apps.policy_check.policy_player import (
    CALLS,
    SECOND,
    PolicyPlayer,
    SyntheticRollout,
    are_equal,
    describe_difference,
    largest_difference,
)
from roboirg.apps.policy_check.turn_check import play_in_turns
from roboirg.core.actions import check_chunk
from roboirg.core.errors import MissingDependencyError, RoboIRGError
from roboirg.core.plain_text import counted, verb_for
from roboirg.policies.by_name.loading import needs_host, planner_alone
from roboirg.policies.contract.base import tell_policy
from roboirg.policies.contract.batch_policy import BatchedEpisode
from roboirg.policies.contract.policy_needs import PolicyNeeds


def check_loading(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that the policy can be made and needs no simulator."""
    try:
        policy = player.make_fresh()
        missing = [name for name in ("reset", "act") if not callable(getattr(policy, name, 0))]
    except MissingDependencyError:
        raise
    except Exception as error:  # the policy's own code runs here
        raise CheckAbortedError("loads", FAIL, describe_error(error)) from error
    if missing:
        raise CheckAbortedError("loads", FAIL, f"It has no {missing[0]}().")
    if hasattr(policy, "attach"):
        raise CheckAbortedError(
            "loads", NOTE, "It is privileged: it needs a simulator, which is not available here."
        )
    name = player.source if isinstance(policy, BatchedEpisode) else type(policy).__name__
    yield CheckResult("loads", PASS, f"{name} was made with seed {player.seed}.")


def check_requirements(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Read what the policy requires."""
    try:
        player.needs = needs = PolicyNeeds.of(player.policy)
    except RoboIRGError as error:
        raise CheckAbortedError("requirements", FAIL, str(error)) from error
    more = ", depth" * needs.depth + ", calibration" * needs.calibration
    yield CheckResult(
        "requirements",
        PASS,
        f"Actions {needs.actions}, cameras {', '.join(needs.cameras) or 'none'}, demonstration "
        f"frames {needs.demonstration_frames}, observations every "
        f"{needs.observe_every or 'chunk'}{more}.",
    )


def check_acting(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check shapes, types and ranges of actions without a video, and time them."""
    try:
        rollout = player.first_rollout
    except CheckAbortedError as error:
        works = find_working_format(player)
        if works is None:
            raise
        check, verdict, message = error.args
        raise CheckAbortedError(
            check, verdict, f"{message[:-1]}; it acts with pictures as {works}: convert them."
        ) from error
    yield from _describe_actions(player, "without a video", rollout)
    steps = sum(map(len, rollout.chunks))
    first, *others = rollout.seconds
    yield CheckResult(
        "time",
        NOTE,
        f"The first call took {1000 * first:.1f} ms, later ones {1000 * np.mean(others):.1f} "
        f"ms; {1000 * sum(rollout.seconds) / steps:.2f} ms per action.",
    )


def check_acting_after_video(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check shapes, types and ranges of actions after a video."""
    yield from _describe_actions(player, "with a video", player.expected)


def _describe_actions(
    player: PolicyPlayer, when: str, rollout: SyntheticRollout
) -> Iterator[CheckResult]:
    space = player.space
    sizes = [len(chunk) for chunk in rollout.chunks]
    outside = sum(
        int(((chunk < space.low) | (chunk > space.high)).any(axis=1).sum())
        for chunk in rollout.chunks
    )
    yield CheckResult(
        f"acts {when}",
        PASS,
        f"Chunks of {', '.join(map(str, sizes))} actions of {space.size} numbers, "
        f"{rollout.dtype}, all finite.",
    )
    if outside:
        have = verb_for(outside, "have")
        yield CheckResult(
            f"range {when}",
            NOTE,
            f"{outside} of {counted(sum(sizes), 'action')} {have} a number outside the usual "
            f"range of {space.name}; the robot executes them as well as it can.",
        )


def check_inputs(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that what the policy is given stays as it is."""
    episode = player.with_video
    given = copy.deepcopy(episode)
    player.play("inputs unchanged", given, in_place=True)
    changed = _first_difference(
        (episode.demonstration, episode.first), (given.demonstration, given.first)
    )
    if changed:
        yield CheckResult("inputs unchanged", FAIL, f"It changed {changed} in place.")
    else:
        yield CheckResult("inputs unchanged", PASS, "Demonstration and observations are unchanged.")


def check_determinism(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that two equal episodes have equal actions."""
    again = player.play("deterministic", player.with_video)
    player.repeatable = are_equal(player.expected, again)
    if player.repeatable:
        yield CheckResult(
            "deterministic", PASS, "Two equal episodes have the same actions, bit for bit."
        )
    elif getattr(player.policy, "deterministic", True):
        difference = describe_difference(player.expected, again)
        yield CheckResult(
            "deterministic",
            FAIL,
            f"Two equal episodes differ by up to {difference}; if that is intended, set "
            "deterministic = False.",
        )
    else:
        yield CheckResult("deterministic", NOTE, "Equal episodes differ, as the policy declares.")


def check_reset(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that an episode does not depend on the one before it."""
    name, expected = "reset forgets", player.expected
    if not _is_deterministic(player):
        yield CheckResult(name, NOTE, "Not checked: the policy is not deterministic.")
        return
    player.play(name, player.without_video)
    after = player.play(name, player.with_video, fresh=False)
    if are_equal(expected, after):
        yield CheckResult(name, PASS, "An episode does not depend on the one before it.")
        return
    # What the policy would have answered next, and what it had answered, in the episode before.
    before = player.play(name, player.without_video, calls=2 * CALLS).chunks
    if _holds(before, after.chunks[0]) and not _holds(before, expected.chunks[0]):
        message = (
            "The first answer after reset() belongs to the previous episode: a queue of actions "
            "outlives the episode; empty it in reset()."
        )
    else:
        message = (
            "A second episode with the same object differs by up to "
            f"{describe_difference(expected, after)} from the same episode played first."
        )
    yield CheckResult(name, FAIL, message)


def check_turns(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check what a host relies on: episodes that share a process do not change each other."""
    spec = player.source
    if not isinstance(spec, str) or not needs_host(spec) or planner_alone(spec):
        return
    if not _is_deterministic(player):
        yield CheckResult("turns", NOTE, "Not checked: the policy is not deterministic.")
        return
    ways = [("turns", "in turns", "the object", False)]
    if hasattr(player.policy, "act_together"):
        ways.append(("batches", "together", "its state", True))
    episodes = player.without_video, player.with_video
    for check, how, where, together in ways:
        try:
            alone = [play_in_turns(spec, player.seed, [one])[0] for one in episodes]
            shared = play_in_turns(spec, player.seed, episodes, together=together)
        except Exception as error:
            raise CheckAbortedError(check, FAIL, describe_error(error)) from error
        difference = max(map(largest_difference, alone, shared))
        if difference == 0:
            yield CheckResult(
                check, PASS, f"Two episodes {how} have the same actions as each alone."
            )
        else:
            yield CheckResult(
                check,
                FAIL,
                f"Two episodes {how} differ by up to {difference:.3g} from each alone; keep what "
                f"belongs to an episode in {where}, not in the module.",
            )


def check_hearing(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that the policy acts after a later utterance, if it has `hear`."""
    if not hasattr(player.policy, "hear"):
        return
    episode = player.without_video
    policy = player.reset("hears", episode)
    try:
        tell_policy(policy, [{"text": SECOND, "step": 1}])
        later = episode._replace(instruction=SECOND)
        check_chunk(policy.act(player.make_episodes().after(later, 1)), player.space)
    except Exception as error:
        raise CheckAbortedError("hears", FAIL, f"hear(): {describe_error(error)}") from error
    yield CheckResult("hears", PASS, "It acts after a second utterance.")


def check_broken_sensors(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that the episode after one with broken sensors works."""
    name, episode = "broken sensors", player.without_video
    policy = player.reset(name, episode)
    try:
        actions = check_chunk(policy.act(player.make_episodes().broken(episode)), player.space)
        reaction = f"it gives {counted(len(actions), 'finite action')}"
    except Exception as error:  # noqa: BLE001 - to raise is one of the right reactions
        reaction = f"it raises ({describe_error(error).rstrip('.')})"
    player.close()
    player.play(name, episode)
    yield CheckResult(name, PASS, f"NaN and noise: {reaction}; the next episode works.")


def _is_deterministic(player: PolicyPlayer) -> bool:
    return player.repeatable and bool(getattr(player.policy, "deterministic", True))


def _holds(chunks: list[Any], chunk: Any) -> bool:  # noqa: ANN401 - arrays
    return any(np.array_equal(one, chunk) for one in chunks)


def _first_difference(before: Any, after: Any, name: str = "") -> str:  # noqa: ANN401 - any nest
    """Return the name of an entry in which two nests of containers and arrays differ, or ``""``."""
    if isinstance(before, np.ndarray):
        same = isinstance(after, np.ndarray) and np.array_equal(before, after)
        return "" if same else name
    if isinstance(before, dict):
        if not isinstance(after, dict) or list(before) != list(after):
            return name or "the names of its inputs"
        pairs = [(str(key), before[key], after[key]) for key in before]
    elif isinstance(before, tuple):
        pairs = [(name, one, other) for one, other in zip(before, after, strict=True)]
    else:
        return "" if before == after else name
    found = (_first_difference(one, other, key) for key, one, other in pairs)
    return next((word for word in found if word), "")
