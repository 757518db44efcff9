"""Checks of a policy's answers against what the scripted expert did at the same moments."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.policy_check.check_result import (
    FAIL,
    NOTE,
    PASS,
    WARN,
    CheckAbortedError,
    CheckResult,
    describe_error,
)
from roboirg.apps.policy_check.conventions import ANSWER_CONVENTIONS, INPUT_CONVENTIONS
from roboirg.apps.policy_check.expert_episode import ExpertEpisode, ExpertMoment, RecordExpert
from roboirg.apps.policy_check.picture_formats import change_observation
from roboirg.apps.policy_check.policy_player import PolicyPlayer
from roboirg.core.actions import ARM_JOINTS, JOINT_ANGLE

FITS = 0.5
"""Of the error of holding still: a policy below it knows where the expert goes."""
FAR_BETTER = 0.4
"""Of the error as it is: below it, another convention fits far better."""
JUMP = 0.5
"""Radians between a joint and its first target. A control step moves a joint by 0.05 rad."""
MIN_MOMENTS = 4
"""With the gripper open, and as many with it closed."""
GRIPPER_GAP = 0.1
"""Between the answers for open and for closed, relative to their range."""

POSITION_SIZE = 3

Chunks = Sequence[NDArray[np.float64]]
_NAME = "expert"


class _Attempt(NamedTuple):
    """A convention that was tried, and how far off the expert's motion the answers are with it."""

    check: str
    error: float
    means: str
    remedy: str


def check_expert(player: PolicyPlayer, record: RecordExpert | None) -> Iterator[CheckResult]:
    """Check the conventions of a policy that acts at control rate.

    Args:
        player: of the policy.
        record: returns the expert's episode; None to check nothing.
    """
    if record is None or player.constant or player.space.takes_many_steps:
        return
    rows = max(map(len, player.first_rollout.chunks))
    try:
        episode = record(player.policy, rows)
    except Exception as error:  # noqa: BLE001 - drivers fail in many ways; not the policy's fault
        yield CheckResult(_NAME, NOTE, f"Not compared: {describe_error(error)}")
        return
    try:
        answers = _ask(player, episode)
    except Exception as error:
        raise CheckAbortedError(_NAME, FAIL, f"act(): {describe_error(error)}") from error
    moments = episode.moments
    yield from _check_gripper(answers, moments)
    still = _error([np.tile(moment.still, (len(moment.actions), 1)) for moment in moments], moments)
    as_is = _error(answers, moments)
    if as_is > FITS * still:
        tried = [*_read_answers(player, answers, moments), *_change_inputs(player, episode)]
        yield from _best_fit(player, tried, as_is, still)
        yield from _check_jumps(player, answers, moments)
    unit = "rad" if player.space is JOINT_ANGLE else "m"
    yield CheckResult(
        _NAME,
        PASS if as_is <= FITS * still else NOTE,
        f"At {len(moments)} moments of an expert's episode the answers are {as_is:.3g} {unit} from "
        f"what it did; holding still would be {still:.3g}.",
    )


def _ask(
    player: PolicyPlayer,
    episode: ExpertEpisode,
    change: Callable[[dict[str, Any]], dict[str, Any]] = dict,
) -> Chunks:
    observations = [change_observation(one.observation, change) for one in episode.moments]
    return player.ask(episode.instruction, change(dict(episode.demonstration)), observations)


def _error(chunks: Chunks, moments: Sequence[ExpertMoment]) -> float:
    """Return the mean distance of the farthest joint, or coordinate, from the expert's.

    A pose's angles have many names, so they are left out.
    """
    return float(np.mean([_distance(*one) for one in zip(chunks, moments, strict=True)]))


def _distance(chunk: NDArray[np.float64], moment: ExpertMoment) -> float:
    size = len(moment.still)
    columns = size if size == ARM_JOINTS else POSITION_SIZE
    rows = min(len(chunk), len(moment.actions))
    difference: NDArray[np.float64] = np.abs(
        chunk[:rows, :columns] - moment.actions[:rows, :columns]
    )
    return float(difference.max(axis=1).mean())


def _best_fit(
    player: PolicyPlayer, tried: list[_Attempt], as_is: float, still: float
) -> Iterator[CheckResult]:
    """Report the convention that fits best, if it fits, and far better than what is agreed."""
    best = min(tried, key=lambda one: one.error, default=None)
    if best is None or best.error > min(FITS * still, FAR_BETTER * as_is) or player.explained:
        return
    player.explained = True
    yield CheckResult(
        best.check,
        WARN,
        f"The answers fit the expert's motion far better {best.means} ({best.error:.3g} off "
        f"instead of {as_is:.3g}). {best.remedy}",
    )


def _read_answers(
    player: PolicyPlayer, answers: Chunks, moments: list[ExpertMoment]
) -> Iterator[_Attempt]:
    """Read the answers in other ways; the last way is that they come late."""
    for convention in ANSWER_CONVENTIONS:
        if convention.space == player.space.name:
            read = [convention.read(*one) for one in zip(answers, moments, strict=True)]
            error = _error(read, moments)
            yield _Attempt(convention.check, error, convention.means, convention.remedy)
    error = _error(answers[1:], moments[:-1])
    remedy = "Each answer comes one call late: compute it from the observation of the same call."
    yield _Attempt("late answers", error, "one moment earlier", remedy)


def _change_inputs(player: PolicyPlayer, episode: ExpertEpisode) -> Iterator[_Attempt]:
    """Ask with observations in other forms."""
    cameras = len(player.needs.cameras)
    for convention in INPUT_CONVENTIONS:
        if cameras < convention.cameras or (convention.only_local and not player.is_local):
            continue
        try:
            error = _error(_ask(player, episode, convention.change), episode.moments)
        except Exception:  # noqa: BLE001, S112 - a policy need not take what is no observation
            continue
        yield _Attempt(convention.check, error, convention.means, convention.remedy)


def _check_jumps(
    player: PolicyPlayer, answers: Chunks, moments: list[ExpertMoment]
) -> Iterator[CheckResult]:
    if player.space is not JOINT_ANGLE or player.explained:
        return
    jumps = [
        float(np.abs(chunk[0, :-1] - moment.still).max())
        for chunk, moment in zip(answers, moments, strict=True)
    ]
    if min(jumps) > JUMP:
        player.explained = True
        yield CheckResult(
            "jumps",
            WARN,
            f"At each of {len(moments)} moments of an expert's episode the first target is "
            f"{min(jumps):.2g} rad or more from the joints; usually normalized targets were not "
            "scaled back, or the joints are in another order.",
        )


def _check_gripper(answers: Chunks, moments: list[ExpertMoment]) -> Iterator[CheckResult]:
    """Check the gripper's numbers: +1 opens, -1 closes."""
    given = np.array([chunk[0, -1] for chunk in answers])
    opens = np.array([moment.actions[0, -1] > 0 for moment in moments])
    if min(opens.sum(), (~opens).sum()) < MIN_MOMENTS:
        return
    opened, closed = given[opens], given[~opens]
    gap = GRIPPER_GAP * (given.max() - given.min())
    if gap > 0 and opened.max() + gap < closed.min():
        message = (
            f"It is {closed.min():.2g} or more whenever the expert holds a cube and "
            f"{opened.max():.2g} or less whenever its gripper is open; +1 opens and -1 closes, so "
            "change the sign."
        )
    elif gap > 0 and closed.max() + gap < opened.min() and closed.min() > -gap:
        message = (
            f"It is between {closed.min():.2g} and {closed.max():.2g} whenever the expert holds a "
            "cube; -1 closes and 0 leaves it half open, so stretch the range from 0 ... 1 (or from "
            "meters) to -1 ... +1."
        )
    else:
        return
    yield CheckResult("gripper", WARN, message)
