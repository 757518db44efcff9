"""What a policy, or a class of policies, requires of its environment."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from roboirg.core.actions import JOINT_ANGLE, ActionSpace, find_action_space
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import (
    CAMERAS,
    DemonstrationFrames,
    check_cameras,
    check_demonstration_frames,
    check_observe_every,
)


def wanted_cameras(policy: object) -> tuple[str, ...]:
    """Return the cameras whose pictures a policy, or a class of policies, wants.

    Raises:
        InvalidValueError: ``cameras`` is not a tuple or list of distinct camera names.
    """
    return check_cameras(getattr(policy, "cameras", CAMERAS))


def wanted_actions(policy: object) -> ActionSpace:
    """Return the action space of a policy, or of a class of policies.

    Raises:
        UnknownNameError: ``actions`` names none.
    """
    return find_action_space(getattr(policy, "actions", JOINT_ANGLE.name))


def wanted_demonstration_frames(policy: object) -> DemonstrationFrames:
    """Return the frames of the video that a policy, or a class of policies, wants.

    Raises:
        InvalidValueError: ``demonstration_frames`` is neither all, none nor every n-th.
    """
    return check_demonstration_frames(getattr(policy, "demonstration_frames", "all"))


def wanted_history(policy: object) -> int | None:
    """Return the control steps between the observations of the history; None for no history.

    Raises:
        InvalidValueError: ``observe_every`` is neither None nor a number of control steps.
    """
    return check_observe_every(getattr(policy, "observe_every", None))


def wanted_history_cameras(policy: object) -> tuple[str, ...] | None:
    """Return the cameras whose pictures a policy, or a class of policies, wants in the history.

    Returns:
        None for those of ``cameras``.

    Raises:
        InvalidValueError: ``history_cameras`` is not a tuple or list of distinct camera names.
    """
    chosen = getattr(policy, "history_cameras", None)
    return None if chosen is None else check_cameras(chosen)


def wanted_depth(policy: object) -> bool:
    """Return whether a policy, or a class of policies, wants depth beside the pictures.

    Raises:
        InvalidValueError: ``depth`` is neither True nor False, or there are no cameras.
    """
    return _beside_pictures(policy, "depth")


def wanted_calibration(policy: object) -> bool:
    """Return whether a policy, or a class of policies, wants the cameras' matrices.

    Raises:
        InvalidValueError: ``calibration`` is neither True nor False, or there are no cameras.
    """
    return _beside_pictures(policy, "calibration")


def wanted_prompt_tokens(policy: object) -> int | None:
    """Return the tokens that a policy's model reads of a prompt; None if it does not say.

    Raises:
        InvalidValueError: ``prompt_tokens`` is neither None nor a number from 1.
    """
    return _whole_number(policy, "prompt_tokens", None, least=1)


def wanted_prompt_added(policy: object) -> int:
    """Return the most tokens of a state or subgoal that share the prompt's budget.

    Raises:
        InvalidValueError: ``prompt_added`` is not a number from 0.
    """
    return _whole_number(policy, "prompt_added", 0, least=0) or 0


def wanted_tokenizer(policy: object) -> str | None:
    """Return the file of the tokenizer of a policy's model; None if it does not say.

    Raises:
        InvalidValueError: ``tokenizer`` is neither None nor a path.
    """
    path = getattr(policy, "tokenizer", None)
    if path is not None and not (isinstance(path, str) and path):
        raise InvalidValueError(f"tokenizer is {path!r}; it must be the path of a file, or None.")
    return path


def wanted_lower_case(policy: object) -> bool:
    """Return whether a policy's client sends prompts in lower case."""
    return bool(getattr(policy, "lowers_prompt", False))


def _whole_number(policy: object, attribute: str, default: int | None, *, least: int) -> int | None:
    value = getattr(policy, attribute, default)
    if value == default and not isinstance(value, bool):
        return default
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise InvalidValueError(f"{attribute} is {value!r}; it must be a number from {least}.")
    return value


def _beside_pictures(policy: object, attribute: str) -> bool:
    wanted = getattr(policy, attribute, False)
    if not isinstance(wanted, bool):
        raise InvalidValueError(f"{attribute} is {wanted!r}; it must be True or False.")
    if wanted and not wanted_cameras(policy):
        raise InvalidValueError(f"{attribute} is True, but cameras is (); name a camera.")
    return wanted


REQUIREMENTS: Mapping[str, Callable[[object], object]] = {
    "cameras": wanted_cameras,
    "actions": wanted_actions,
    "demonstration_frames": wanted_demonstration_frames,
    "observe_every": wanted_history,
    "history_cameras": wanted_history_cameras,
    "depth": wanted_depth,
    "calibration": wanted_calibration,
    "prompt_tokens": wanted_prompt_tokens,
    "prompt_added": wanted_prompt_added,
    "tokenizer": wanted_tokenizer,
    "lowers_prompt": wanted_lower_case,
}
"""The function that reads each attribute of a policy and checks it."""
