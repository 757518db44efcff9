"""The kinds of policies that ``learned:PATH`` and ``trained:PATH`` name."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboirg.extension.commands import InvalidValueError, known_name
from roboirg.extension.policies import PolicyKind, followed
from roboirg_learn.learn_support import check_learn_support, file_version

if TYPE_CHECKING:
    from roboirg_learn.policy.joint_chunks import JointChunks
    from roboirg_learn.policy.learned_policy import LearnedPolicy
    from roboirg_learn.policy.policy_model import PolicyModel

ACTIONS, HANDS = "actions", "hands"
"""Options of ``trained:``: the action space, or what follows the subgoals of its planner."""
SPACES = "waypoint", "joint_angle"


def _checked_path(
    spec: str, name: str, options: Mapping[str, str], known: tuple[str, ...] = ()
) -> Path:
    for option in options:
        known_name(f"option of {spec.partition(':')[0]}:", option, known)
    if not name:
        raise InvalidValueError(f"Policy {spec!r} names no file.")
    return Path(name)


def _learned(spec: str, name: str, options: Mapping[str, str]) -> Callable[[int], Any]:
    """Return what makes listeners that learned."""
    from roboirg_learn.listener.learned_listener import LearnedListener

    return functools.partial(LearnedListener, _checked_path(spec, name, options))


def _trained(spec: str, name: str, options: Mapping[str, str]) -> Callable[[int], Any]:
    """Return what makes learned policies; with ``hands=…`` learned planners with those hands."""
    path, hands = _checked_path(spec, name, options, (ACTIONS, HANDS)), options.get(HANDS)
    actions = known_name("actions of trained:", options.get(ACTIONS, SPACES[0]), SPACES)
    if hands is None:
        return lambda seed: make_learned(path, seed, actions)
    if ACTIONS in options:
        raise InvalidValueError(f"Policy {spec!r} has other hands, which have their own actions.")

    def make(seed: int) -> object:
        from roboirg_learn.policy.subgoal_following import LearnedPlanner

        model, version = _load(path)
        if model.planner is None:
            raise InvalidValueError(
                f"Policy {spec!r} has no planner for other hands; learn one with --memory subgoal."
            )
        return followed(LearnedPlanner(model, version), hands, seed, spec)

    return make


def make_learned(
    path: Path, seed: int = 0, actions: str = SPACES[0]
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
    from roboirg_learn.policy.joint_chunks import JointChunks, JointChunksOfHands
    from roboirg_learn.policy.learned_policy import LearnedPolicy
    from roboirg_learn.policy.subgoal_following import LearnedHands

    model, version = _load(path)
    made = (LearnedPolicy if model.planner is None else LearnedHands)(model, version, seed)
    if actions == SPACES[0]:
        return made
    return JointChunksOfHands(made) if isinstance(made, LearnedHands) else JointChunks(made)


def _load(path: Path) -> tuple[PolicyModel, str]:
    check_learn_support()
    version = file_version(path, "policy")
    return _model(path, version), version


@functools.lru_cache(maxsize=4)
def _model(path: Path, version: str) -> PolicyModel:
    """Return what a file of that version holds; episodes change nothing in it."""
    del version
    from roboirg_learn.policy.policy_model import load_policy

    return load_policy(path)


LEARNED = PolicyKind("learned", _learned)
TRAINED = PolicyKind("trained", _trained, has_weights=True)
