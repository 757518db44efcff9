"""The kinds of policies that ``learned:PATH`` and ``trained:PATH`` name."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboirg.extension.commands import InvalidValueError, known_name
from roboirg.extension.policies import PolicyKind, followed
from roboirg_learn.learn_support import check_learn_support
from roboirg_learn.policy.policy_files import PolicyFiles

if TYPE_CHECKING:
    from roboirg_learn.policy.joint_chunks import JointChunks
    from roboirg_learn.policy.learned_policy import LearnedPolicy
    from roboirg_learn.policy.policy_model import PolicyModel

READER = "reader"
"""Option of ``trained:``: the file of its reader."""
ACTIONS = "actions"
"""Option: the action space."""
HANDS = "hands"
"""Option: what follows the subgoals of its planner."""
SPACES = ("waypoint", "joint_angle")
"""Action spaces, the usual one first."""


def _checked_path(
    spec: str, name: str, options: Mapping[str, str], known: tuple[str, ...] = ()
) -> Path:
    """Return the path in a policy's spec, after checking that its options are known.

    Args:
        spec: the whole, such as ``trained:body.safetensors?reader=reader.safetensors``.
        name: the path in it: ``body.safetensors``.
        options: those after the question mark: ``{"reader": "reader.safetensors"}``.
        known: names of options that there are.

    Raises:
        InvalidValueError: there is no path, or an option is unknown.
    """
    for option in options:
        known_name(f"option of {spec.partition(':')[0]}:", option, known)
    if not name:
        raise InvalidValueError(f"Policy {spec!r} names no file.")
    return Path(name)


def _learned_listener_maker(
    spec: str, name: str, options: Mapping[str, str]
) -> Callable[[int], Any]:
    """Return a function from a seed to the learned listener of a file, for ``learned:FILE``."""
    from roboirg_learn.listener.learned_listener import LearnedListener

    return functools.partial(LearnedListener, _checked_path(spec, name, options))


def _learned_namer_maker(spec: str, name: str, options: Mapping[str, str]) -> Callable[[int], Any]:
    """Return a function from a seed to what names the goals of a learned listener."""
    from roboirg_learn.listener.learned_listener import LearnedNamer

    path = _checked_path(spec, name, options)
    return lambda _seed: LearnedNamer(path)


def _trained_policy_maker(spec: str, name: str, options: Mapping[str, str]) -> Callable[[int], Any]:
    """Return a function from a seed to a trained policy, for ``trained:BODY?reader=FILE``.

    With ``hands=POLICY`` it is a planner, which names subgoals, and another policy follows them.
    """
    body = _checked_path(spec, name, options, (READER, ACTIONS, HANDS))
    if not options.get(READER):
        raise InvalidValueError(
            f"Policy {spec!r} has a body, but no reader of words; name one with ?reader=FILE. "
            f"Train one with: roboirg learn reader --body {name} --out FILE."
        )
    files = PolicyFiles(body, Path(options[READER]))
    actions = known_name("actions of trained:", options.get(ACTIONS, SPACES[0]), SPACES)
    hands = options.get(HANDS)
    if hands is None:
        return lambda seed: make_learned(files, seed, actions)
    if ACTIONS in options:
        raise InvalidValueError(f"Policy {spec!r} has other hands, which have their own actions.")
    return lambda seed: _planner_for_hands(hands, files, seed, spec)


def _planner_for_hands(hands: str, files: PolicyFiles, seed: int, spec: str) -> object:
    """Return the planner of two files, whose subgoals another policy follows.

    Args:
        hands: spec of the policy that follows.
        files: of a body with a planner, and its reader.
        seed: of the policy that follows.
        spec: of the whole, for messages.
    """
    from roboirg_learn.policy.subgoal_following import LearnedPlanner

    model = _load(files)
    if model.body.planner is None:
        raise InvalidValueError(
            f"Policy {spec!r} has no planner for other hands; learn one with --memory subgoal."
        )
    return followed(LearnedPlanner(model), hands, seed, spec)


def make_learned(
    files: PolicyFiles, seed: int = 0, actions: str = SPACES[0]
) -> LearnedPolicy | JointChunks:
    """Return the policy of a body's and a reader's file.

    If the body has a planner, the policy can also follow the subgoals of another planner.

    Args:
        files: of its body and its reader.
        seed: without effect, as nothing is random.
        actions: name of the action space, waypoint or joint_angle.

    Raises:
        InvalidValueError: a file is none, or they do not fit.
        MissingDependencyError: there is no PyTorch.
    """
    from roboirg_learn.policy.joint_chunks import JointChunks, JointChunksOfHands
    from roboirg_learn.policy.learned_policy import LearnedPolicy
    from roboirg_learn.policy.subgoal_following import LearnedHands

    model = _load(files)
    is_waypoint = actions == SPACES[0]
    if model.body.planner is None:
        policy = LearnedPolicy(model, seed)
        return policy if is_waypoint else JointChunks(policy)
    hands = LearnedHands(model, seed)
    return hands if is_waypoint else JointChunksOfHands(hands)


def _load(files: PolicyFiles) -> PolicyModel:
    """Return the policy of two files as they are now; loaded files are used again."""
    check_learn_support()
    return _cached_model(files, files.changed)


@functools.lru_cache(maxsize=4)
def _cached_model(files: PolicyFiles, changed: tuple[int, ...]) -> PolicyModel:
    """Return the policy of two files, kept in memory as long as the files do not change.

    Many episodes share it, as playing changes nothing in it.

    Args:
        files: of body and reader.
        changed: when they were written; only makes a call with changed files another one.
    """
    del changed
    from roboirg_learn.policy.policy_model import load_policy

    return load_policy(files)


LEARNED = PolicyKind("learned", _learned_listener_maker, read_namer=_learned_namer_maker)
TRAINED = PolicyKind("trained", _trained_policy_maker, has_weights=True)
