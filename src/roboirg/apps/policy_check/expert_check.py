"""Check of a policy's answers against what the scripted expert did at the same moments."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from roboirg.apps.policy_check.check_result import CheckResult, describe_error, ending_checks
from roboirg.apps.policy_check.expert_episode import ExpertMoment, RecordExpert, Rows
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
    """Check the answers of a policy that acts at control rate.

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
    still = _error([np.tile(moment.still, (len(moment.actions), 1)) for moment in moments], moments)
    as_is = _error(answers, moments)
    unit = "rad" if player.space is JOINT_ANGLE else "m"
    yield CheckResult(
        _NAME,
        "pass" if as_is <= FITS * still else "note",
        f"At {len(moments)} moments of an expert's episode the answers are {as_is:.3g} {unit} from "
        f"what it did; holding still would be {still:.3g}.",
    )


def _error(chunks: Chunks, moments: Sequence[ExpertMoment]) -> float:
    """Return the mean distance of the farthest joint, or coordinate, from the expert's.

    A pose's angles have many names, so they are left out.
    """
    return float(np.mean([_distance(*one) for one in zip(chunks, moments, strict=True)]))


def _distance(chunk: Rows, moment: ExpertMoment) -> float:
    size = len(moment.still)
    columns = size if size == ARM_JOINTS else POSITION_SIZE
    rows = min(len(chunk), len(moment.actions))
    difference: Rows = np.abs(chunk[:rows, :columns] - moment.actions[:rows, :columns])
    return float(difference.max(axis=1).mean())


def _check_gripper(answers: Chunks, moments: list[ExpertMoment]) -> Iterator[CheckResult]:
    """Check the gripper's numbers: +1 opens, -1 closes."""
    given = np.array([chunk[0, -1] for chunk in answers])
    opens = np.array([moment.actions[0, -1] > 0 for moment in moments])
    if min(opens.sum(), (~opens).sum()) < MIN_MOMENTS:
        return
    opened = given[opens]
    closed = given[~opens]
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
    yield CheckResult("gripper", "warn", message)
