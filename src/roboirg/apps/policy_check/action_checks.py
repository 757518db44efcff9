"""Checks of the numbers in joint targets, which need no reference."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.policy_check.check_result import FAIL, WARN, CheckResult
from roboirg.apps.policy_check.policy_player import PolicyPlayer
from roboirg.core.actions import ARM_JOINTS, JOINT_ANGLE, JOINT_HIGH, JOINT_LOW

BENT_JOINT = 3
"""The fourth: its upper limit is below 0, so that no position has all joints near 0."""
NEAR_ZERO = 0.5
"""Radians. A change of the joints during a chunk is smaller, and so is a normalized output."""
MANY_RADIANS = 2 * np.pi
"""Beyond every joint limit, with room."""


def check_joint_units(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that joint targets are not within the limits as degrees, and far beyond as radians."""
    joints = _joint_targets(player)
    radians = np.deg2rad(joints)
    within = ((radians >= JOINT_LOW) & (radians <= JOINT_HIGH)).all()
    if len(joints) and within and (np.abs(joints).max(axis=1) > MANY_RADIANS).all():
        player.explained = True
        yield CheckResult(
            "joint units",
            FAIL,
            "Joint targets are within the robot's limits if read as degrees and far beyond them "
            "as radians; convert them to radians.",
        )


def check_joint_targets(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that joint targets can be absolute, unless it is known what is wrong with them."""
    joints, limit = _joint_targets(player), JOINT_HIGH[BENT_JOINT]
    near_zero = (joints[:, BENT_JOINT] > limit).all() and (np.abs(joints) < NEAR_ZERO).all()
    if len(joints) and near_zero and not player.explained:
        yield CheckResult(
            "joint targets",
            WARN,
            f"All are within {NEAR_ZERO} rad of 0, which joint {BENT_JOINT + 1} (at most {limit} "
            "rad) cannot reach; usually they are changes of the joints, or normalized values "
            "that were not scaled back. Absolute targets in radians are expected.",
        )


def _joint_targets(player: PolicyPlayer) -> NDArray[np.float64]:
    """Return all joint targets, (n, 7); none if the policy gives others, or always the same."""
    if player.space is not JOINT_ANGLE or player.constant:
        return np.empty((0, ARM_JOINTS))
    chunks = [*player.first_rollout.chunks, *player.expected.chunks]
    joints: NDArray[np.float64] = np.concatenate(chunks)[:, :ARM_JOINTS]
    return joints
