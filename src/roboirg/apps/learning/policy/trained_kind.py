"""The kind of policies that ``trained:PATH`` names: a policy that learned to act."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from roboirg.apps.learning.learn_support import check_learn_support, file_version
from roboirg.apps.learning.policy.joint_chunks import JointChunks, JointChunksOfHands
from roboirg.apps.learning.policy.learned_policy import LearnedPolicy
from roboirg.apps.learning.policy.subgoal_following import LearnedHands, LearnedPlanner
from roboirg.core.actions import JOINT_ANGLE, WAYPOINT
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.policy_ref import HANDS
from roboirg.policies.by_name.policy_kinds import PolicyKind, PolicyMaker, make_follower
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy

if TYPE_CHECKING:
    from roboirg.apps.learning.policy.policy_model import PolicyModel

ACTIONS = "actions"
"""Option: the action space."""


def _trained(spec: str, name: str, options: Mapping[str, str]) -> PolicyMaker:
    """Return what makes learned policies; with ``hands=…`` learned planners with those hands."""
    if others := sorted(options.keys() - {ACTIONS, HANDS}):
        raise UnknownNameError("option of trained:", others[0], [ACTIONS, HANDS])
    if not name:
        raise InvalidValueError(f"Policy {spec!r} names no file.")
    path, hands = Path(name), options.get(HANDS)
    actions = options.get(ACTIONS, WAYPOINT.name)
    if actions not in (WAYPOINT.name, JOINT_ANGLE.name):
        raise UnknownNameError("actions of trained:", actions, [WAYPOINT.name, JOINT_ANGLE.name])
    if hands is None:
        return lambda seed: make_learned(path, seed, actions)
    if ACTIONS in options:
        raise InvalidValueError(f"Policy {spec!r} has other hands, which have their own actions.")

    def make(seed: int) -> HierarchicalPolicy:
        model, version = _load(path)
        if model.planner is None:
            raise InvalidValueError(
                f"Policy {spec!r} has no planner for other hands; learn one with --memory subgoal."
            )
        return HierarchicalPolicy(LearnedPlanner(model, version), make_follower(hands, seed), spec)

    return make


def make_learned(
    path: Path, seed: int = 0, actions: str = WAYPOINT.name
) -> LearnedPolicy | JointChunks:
    """Return the policy of a file; one with a planner follows the subgoals of others, too.

    Args:
        path: of the file.
        seed: without effect, as nothing is random.
        actions: name of the action space, waypoint or joint_angle.

    Raises:
        InvalidValueError: the file is none.
        MissingDependencyError: there is no PyTorch.
    """
    model, version = _load(path)
    if model.planner is None:
        policy = LearnedPolicy(model, version, seed)
        return JointChunks(policy) if actions == JOINT_ANGLE.name else policy
    hands = LearnedHands(model, version, seed)
    return JointChunksOfHands(hands) if actions == JOINT_ANGLE.name else hands


def _load(path: Path) -> tuple[PolicyModel, str]:
    check_learn_support()
    version = file_version(path, "policy")
    return _model(path, version), version


@functools.lru_cache(maxsize=4)
def _model(path: Path, version: str) -> PolicyModel:
    """Return what a file of that version holds; episodes change nothing in it."""
    del version
    from roboirg.apps.learning.policy.policy_model import load_policy

    return load_policy(path)


KIND = PolicyKind("trained", _trained, has_weights=True)
