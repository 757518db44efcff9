"""Check of a policy's answers against what the scripted expert did at the same moments."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from roboirg.apps.policy_check.check_result import CheckResult, describe_error, ending_checks
from roboirg.apps.policy_check.expert_episode import ExpertMoment, RecordExpert
from roboirg.apps.policy_check.policy_player import Chunks, PolicyPlayer
from roboirg.core.actions import ARM_JOINTS, JOINT_ANGLE

FITS = 0.5
"""Of the error of holding still: a policy below it knows where the expert goes."""
MIN_MOMENTS = 4
"""With the gripper open, and as many with it closed."""
GRIPPER_GAP = 0.1
"""Between the answers for open and for closed, relative to their range."""

POSITION_SIZE = 3

_NAME = "expert"


def check_expert(player: PolicyPlayer, record: RecordExpert | None) -> Iterator[CheckResult]:
    """Compare a policy's answers with what the expert did at the same moments of an episode.

    Holding still is the yardstick: answers that are hardly nearer to the expert's actions get a
    note. Policies whose actions take many control steps are not compared.

    Args:
        player: of the policy.
        record: returns the expert's episode; None to check nothing.
    """
    if record is None:
        return
    if player.space.takes_many_steps:
        message = f"Not checked: a {player.space.name} takes many control steps."
        yield CheckResult(_NAME, "note", message)
        return
    rows = max(map(len, player.first_rollout.chunks))
    try:
        episode = record(player.policy, rows)
    except Exception as error:  # noqa: BLE001 - drivers fail in many ways; not the policy's fault
        yield CheckResult(_NAME, "note", f"Not compared: {describe_error(error)}")
        return
    moments = episode.moments
    with ending_checks(_NAME, "act(): "):
        answers = player.ask(episode)
    yield from _check_gripper(answers, moments)
    unit = "rad" if player.space is JOINT_ANGLE else "m"
    yield _check_distance(answers, moments, unit)


def _check_distance(answers: Chunks, moments: Sequence[ExpertMoment], unit: str) -> CheckResult:
    """Return a pass if answers are at most half as far from the expert's actions as holding still.

    Args:
        answers: of the policy, one for each moment.
        moments: of the expert's episode.
        unit: of distances, for the message.
    """
    holding_still = [np.tile(moment.still, (len(moment.actions), 1)) for moment in moments]
    most = FITS * _error(holding_still, moments)
    distance = _error(answers, moments)
    return CheckResult(
        _NAME,
        "pass" if distance <= most else "note",
        f"Distance from what an expert did at {len(moments)} moments: expected at most {most:.3g} "
        f"{unit}, half of that of holding still, got {distance:.3g}.",
    )


def _error(chunks: Chunks, moments: Sequence[ExpertMoment]) -> float:
    """Return how far chunks of actions are from the expert's, on average over the moments.

    The distance of an action is that of its farthest joint, rad, or coordinate, m. A pose's angles
    are left out, as different numbers can mean the same rotation, and so is the gripper.

    Args:
        chunks: (n, size), one for each moment; rows beyond the expert's do not count.
        moments: of the expert's episode.
    """
    distances: list[float] = []
    for chunk, moment in zip(chunks, moments, strict=True):
        size = len(moment.still)
        columns = size if size == ARM_JOINTS else POSITION_SIZE  # joints, or a pose's position
        rows = min(len(chunk), len(moment.actions))
        difference = np.abs(chunk[:rows, :columns] - moment.actions[:rows, :columns])
        farthest = difference.max(axis=1)
        distances.append(float(farthest.mean()))
    return float(np.mean(distances))


def _check_gripper(answers: Chunks, moments: list[ExpertMoment]) -> Iterator[CheckResult]:
    """Warn if the gripper's numbers have the wrong sign or range: +1 opens, -1 closes.

    The numbers at moments where the expert's gripper opens are compared with those where it closes.
    If they lie clearly apart the wrong way round, the sign is wrong. If they lie the right way
    round, but closing is not below 0, the range is 0 to 1 and not -1 to +1. With too few moments of
    either kind, nothing is said.

    Args:
        answers: the policy's chunks (n, size), one for each moment; the gripper comes last in a
            row.
        moments: of the expert's episode.
    """
    given = np.array([chunk[0, -1] for chunk in answers])
    expert_opens = np.array([moment.actions[0, -1] > 0 for moment in moments])
    opened = given[expert_opens]
    closed = given[~expert_opens]
    if min(len(opened), len(closed)) < MIN_MOMENTS:
        return
    # By how much the two must be apart.
    gap = GRIPPER_GAP * (given.max() - given.min())
    if gap > 0 and opened.max() + gap < closed.min():
        message = (
            "Expected +1 whenever the expert's gripper is open and -1 whenever it holds a cube, "
            f"got {opened.max():.2g} or less and {closed.min():.2g} or more; change the sign."
        )
    elif gap > 0 and closed.max() + gap < opened.min() and closed.min() > -gap:
        message = (
            "Expected -1 whenever the expert holds a cube, got "
            f"{closed.min():.2g} to {closed.max():.2g}, and 0 leaves it half open; stretch the "
            "range from 0 ... 1 (or from meters) to -1 ... +1."
        )
    else:
        return
    yield CheckResult("gripper", "warn", message)
