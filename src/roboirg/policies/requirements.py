"""What a policy, or a class of policies, asks of its environment."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from roboirg.core.actions import JOINT_ANGLE, ActionSpace, find_action_space
from roboirg.core.observations import (
    CAMERAS,
    DemonstrationFrames,
    check_cameras,
    check_demonstration_frames,
    check_observe_every,
)


def wanted_cameras(policy: object) -> tuple[str, ...]:
    """The pictures that a policy, or a class of policies, asks for.

    Raises:
        InvalidValueError: its ``cameras`` are not different names of cameras in a tuple or list.
    """
    return check_cameras(getattr(policy, "cameras", CAMERAS))


def wanted_actions(policy: object) -> ActionSpace:
    """The action space in which a policy, or a class of policies, gives its actions.

    Raises:
        UnknownNameError: its ``actions`` name none.
    """
    return find_action_space(getattr(policy, "actions", JOINT_ANGLE.name))


def wanted_demonstration_frames(policy: object) -> DemonstrationFrames:
    """The pictures of the video that a policy, or a class of policies, asks for.

    Raises:
        InvalidValueError: its ``demonstration_frames`` are neither all, none nor every n-th.
    """
    return check_demonstration_frames(getattr(policy, "demonstration_frames", "all"))


def wanted_history(policy: object) -> int | None:
    """After how many control steps a policy, or a class of policies, wants to look.

    Raises:
        InvalidValueError: its ``observe_every`` is neither None nor a number of control steps.
    """
    return check_observe_every(getattr(policy, "observe_every", None))


def wanted_history_cameras(policy: object) -> tuple[str, ...] | None:
    """The pictures that a policy, or a class of policies, wants in the history.

    Returns:
        None for all that it wants of the present.

    Raises:
        InvalidValueError: its ``history_cameras`` are not different names of cameras.
    """
    chosen = getattr(policy, "history_cameras", None)
    return None if chosen is None else check_cameras(chosen)


WISHES: Mapping[str, Callable[[object], object]] = {
    "cameras": wanted_cameras,
    "actions": wanted_actions,
    "demonstration_frames": wanted_demonstration_frames,
    "observe_every": wanted_history,
    "history_cameras": wanted_history_cameras,
}
