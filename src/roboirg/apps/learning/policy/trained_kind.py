"""The kind of policies that ``trained:PATH`` names: a policy that learned to act."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from roboirg.apps.learning.learn_support import check_learn_support, file_version
from roboirg.apps.learning.policy.learned_policy import LearnedPolicy
from roboirg.apps.learning.policy.subgoal_following import LearnedHands, LearnedPlanner
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.policies.by_name.policy_specs import PolicyKind, PolicyMaker, make_follower
from roboirg.policies.by_name.systems import HANDS
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy, with_planner

if TYPE_CHECKING:
    from roboirg.apps.learning.policy.policy_model import PolicyModel


def _trained(spec: str, name: str, options: Mapping[str, str]) -> PolicyMaker:
    """Return what makes learned policies; with ``hands=…`` learned planners with those hands."""
    if others := sorted(options.keys() - {HANDS}):
        raise UnknownNameError("option of trained:", others[0], [HANDS])
    if not name:
        raise InvalidValueError(f"Policy {spec!r} names no file.")
    path = Path(name)
    hands = options.get(HANDS)
    if hands is None:
        return lambda seed: make_learned(path, seed)

    def make(seed: int) -> HierarchicalPolicy:
        model, version = _load(path)
        if model.planner is None:
            raise InvalidValueError(
                f"Policy {spec!r} has no planner for other hands; learn one with --memory subgoal."
            )
        return with_planner(LearnedPlanner(model, version), make_follower(hands, seed), spec)

    return make


def make_learned(path: Path, seed: int = 0) -> LearnedPolicy:
    """Return the policy of a file; one with a planner follows the subgoals of others, too.

    Raises:
        InvalidValueError: the file is none.
        MissingDependencyError: there is no PyTorch.
    """
    model, version = _load(path)
    kind = LearnedPolicy if model.planner is None else LearnedHands
    return kind(model, version, seed)


def _load(path: Path) -> tuple[PolicyModel, str]:
    check_learn_support()
    from roboirg.apps.learning.policy.policy_model import load_policy

    version = file_version(path, "policy")
    return load_policy(path), version


KIND = PolicyKind("trained", _trained, has_weights=True)
