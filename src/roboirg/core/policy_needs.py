"""What a policy needs of its environment and of its prompt, as one value.

Policies declare needs as attributes, which `PolicyNeeds.of` reads and checks. A new need is a field
here and the code that uses it: reading, checking, merging and transport go over all fields.
"""

from __future__ import annotations

import inspect
import math
import operator
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Any, Self

from roboirg.core.actions import JOINT_ANGLE, ActionSpace, find_action_space
from roboirg.core.environment_options import (
    DemonstrationFrames,
    check_demonstration_frames,
    check_observe_every,
)
from roboirg.core.errors import InvalidValueError
from roboirg.core.field_types import check_whole
from roboirg.core.observations import CAMERAS, check_cameras

_MISSING = object()


def merge_cameras(one: tuple[str, ...], other: tuple[str, ...]) -> tuple[str, ...]:
    """Return the cameras that either of two needs, in the order of `CAMERAS`."""
    return tuple(camera for camera in CAMERAS if camera in (*one, *other))


def merge_demonstration_frames(
    one: DemonstrationFrames, other: DemonstrationFrames
) -> DemonstrationFrames:
    """Return the frames of the video that contain those that each of two needs.

    A number n stands for every n-th frame. 4 and 6 -> 2; ``"none"`` and 4 -> 4; 2 and 3 ->
    ``"all"``.
    """
    strides = [1 if frames == "all" else int(frames) for frames in (one, other) if frames != "none"]
    if not strides:
        return "none"
    stride = math.gcd(*strides)
    return "all" if stride == 1 else stride


def merge_observe_every(one: int | None, other: int | None) -> int | None:
    """Return the control steps between observations that contain those that each of two needs.

    The greatest common divisor: 4 and 6 -> 2. None is no need: None and 4 -> 4, None twice -> None.
    """
    periods = [period for period in (one, other) if period is not None]
    return math.gcd(*periods) if periods else None


def merge_trained_tasks(
    one: tuple[str, ...] | None, other: tuple[str, ...] | None
) -> tuple[str, ...] | None:
    """Return the tasks that both of two were trained on, in the order of the first.

    None declares nothing, so it restricts nothing: None and ``("PickXtimes",)`` ->
    ``("PickXtimes",)``.
    """
    if one is None:
        return other
    if other is None:
        return one
    return tuple(task for task in one if task in other)


def _check_trained_tasks(tasks: object) -> tuple[str, ...]:
    """Return a value as names of tasks."""
    if isinstance(tasks, tuple | list) and all(isinstance(task, str) for task in tasks):
        return tuple(tasks)
    raise InvalidValueError(
        f"trained_tasks is {tasks!r}; it must be a tuple of names such as ('PickXtimes',), or None."
    )


def _check_flag(name: str, value: object) -> bool:
    """Return a value if it is True or False."""
    if not isinstance(value, bool):
        raise InvalidValueError(f"{name} is {value!r}; it must be True or False.")
    return value


def _check_tokenizer(path: object) -> str:
    """Return a value if it may be the path of a file."""
    if not (isinstance(path, str) and path):
        raise InvalidValueError(f"tokenizer is {path!r}; it must be the path of a file, or None.")
    return path


def need_rules(
    check: Callable[[Any], object],
    merge: Callable[[Any, Any], object] | None = None,
    *,
    env: bool = False,
) -> dict[str, Any]:
    """Return the metadata of a field of `PolicyNeeds`.

    Args:
        check: returns a value in its final form, or raises `InvalidValueError`; it never gets the
            default None.
        merge: returns what serves a policy and its planner; None if planners have no such need.
        env: whether it is an option of the environment, of the same name.
    """
    return {"check": check, "merge": merge, "env": env}


@dataclass(frozen=True, kw_only=True)
class PolicyNeeds:
    """What a policy needs, each under the name of the attribute that declares it.

    Attributes:
        cameras: whose pictures observations hold.
        actions: name of the action space.
        demonstration_frames: frames of the video.
        observe_every: control steps between two observations in ``history``; None for no history.
        history_cameras: whose pictures ``history`` holds; None becomes `cameras`.
        depth: whether there is depth for the same cameras.
        calibration: whether there are the matrices of the same cameras.
        grounded: whether subgoals come with pixels.
        prompt_tokens: that the policy's model reads of a prompt; None if it is not declared.
        prompt_added: most tokens of a state or subgoal that share this budget.
        tokenizer: file of the model's tokenizer; None if it is not declared.
        lowers_prompt: whether prompts are sent in lower case.
        trained_tasks: on which it was trained, the only ones that it knows; None if it is not
            declared.

    Raises:
        InvalidValueError: a value is invalid, or there is no camera for depth or calibration.
        UnknownNameError: there is no such action space or camera.
    """

    cameras: tuple[str, ...] = field(
        default=CAMERAS, metadata=need_rules(check_cameras, merge_cameras, env=True)
    )
    actions: str = field(
        default=JOINT_ANGLE.name,
        metadata=need_rules(lambda name: find_action_space(name).name, env=True),
    )
    demonstration_frames: DemonstrationFrames = field(
        default="all",
        metadata=need_rules(check_demonstration_frames, merge_demonstration_frames, env=True),
    )
    observe_every: int | None = field(
        default=None, metadata=need_rules(check_observe_every, merge_observe_every, env=True)
    )
    history_cameras: tuple[str, ...] | None = field(
        default=None, metadata=need_rules(check_cameras, merge_cameras, env=True)
    )
    depth: bool = field(
        default=False, metadata=need_rules(partial(_check_flag, "depth"), operator.or_, env=True)
    )
    calibration: bool = field(
        default=False,
        metadata=need_rules(partial(_check_flag, "calibration"), operator.or_, env=True),
    )
    grounded: bool = field(default=False, metadata=need_rules(bool, operator.or_, env=True))
    # A planner's model has a context of its own, which no instruction fills.
    prompt_tokens: int | None = field(
        default=None, metadata=need_rules(partial(check_whole, "prompt_tokens"))
    )
    prompt_added: int = field(
        default=0, metadata=need_rules(partial(check_whole, "prompt_added", least=0))
    )
    tokenizer: str | None = field(default=None, metadata=need_rules(_check_tokenizer))
    lowers_prompt: bool = field(default=False, metadata=need_rules(bool))
    trained_tasks: tuple[str, ...] | None = field(
        default=None, metadata=need_rules(_check_trained_tasks, merge_trained_tasks)
    )

    def __post_init__(self) -> None:
        """Replace each value by its final form, as its rule `check` returns it.

        A need that is not declared, None by default, is not checked.
        """
        for need in fields(self):
            value = getattr(self, need.name)
            is_undeclared = value is None and need.default is None
            if not is_undeclared:
                checked = need.metadata["check"](value)
                object.__setattr__(self, need.name, checked)  # as the dataclass is frozen
        if self.history_cameras is None:
            object.__setattr__(self, "history_cameras", self.cameras)
        for name in ("depth", "calibration"):
            if getattr(self, name) and not self.cameras:
                raise InvalidValueError(f"{name} is True, but cameras is (); name a camera.")

    @classmethod
    def of(cls, policy: object, *names: str) -> Self:
        """Return what a policy, or a class of policies, declares.

        Args:
            policy: the policy or class. A property of a class counts as not declared: its value is
                known only for an object.
            names: needs to read, all by default; the others get their defaults.

        Raises:
            InvalidValueError: an attribute has an invalid value.
        """
        wanted = names or [need.name for need in fields(cls)]
        return cls(**_declared(policy, wanted))

    @classmethod
    def of_planner(cls, planner: object) -> Self:
        """Return what a planner, which names subgoals, declares; by default, it needs no pictures.

        Only needs that have a rule for merging are read; see `need_rules`.
        """
        values: dict[str, Any] = {"cameras": (), "demonstration_frames": "none"}
        values |= _declared(planner, _names(cls, "merge"))
        return cls(**values)

    @property
    def action_space(self) -> ActionSpace:
        """The action space that `actions` names."""
        return find_action_space(self.actions)

    @property
    def env_options(self) -> dict[str, Any]:
        """The options of an environment that meets the needs, as `roboirg.make` takes them."""
        return {name: getattr(self, name) for name in _names(type(self), "env")}

    @property
    def declared(self) -> dict[str, Any]:
        """The needs without those that are None, as JSON values: tuples become lists.

        The way back is ``PolicyNeeds(**declared)``: the checks of the fields accept lists.
        """
        declared = {}
        for need in fields(self):
            value = getattr(self, need.name)
            if value is not None:
                declared[need.name] = list(value) if isinstance(value, tuple) else value
        return declared

    def merge(self, planner: PolicyNeeds) -> Self:
        """Return the needs of this policy together with those of the planner that guides it.

        Needs that planners do not have, such as the action space, stay this policy's.
        """
        merged = {}
        for need in fields(self):
            merge = need.metadata["merge"]
            if merge is not None:
                merged[need.name] = merge(getattr(self, need.name), getattr(planner, need.name))
        return replace(self, **merged)

    def declare_on(self, policy: object) -> None:
        """Set the attributes of a policy, or of what stands for one, so that `of` reads these."""
        for need in fields(self):
            setattr(policy, need.name, getattr(self, need.name))


def _names(needs: type[PolicyNeeds], rule: str) -> tuple[str, ...]:
    """Return the names of the needs that have a rule of `need_rules`, such as ``env``."""
    return tuple(need.name for need in fields(needs) if need.metadata[rule])


ENV_NEEDS = _names(PolicyNeeds, "env")
"""Needs that are options of the environment."""


def _declared(policy: object, names: Iterable[str]) -> dict[str, Any]:
    """Return the attributes of those names that a policy, or a class of policies, has.

    A policy with ``cameras = ("front",)`` and nothing else -> ``{"cameras": ("front",)}``. Values
    are not checked here.
    """
    is_class = inspect.isclass(policy)
    declared = {}
    for name in names:
        if is_class and hasattr(inspect.getattr_static(policy, name, None), "__get__"):
            continue  # a property, whose value only an object has
        value = getattr(policy, name, _MISSING)
        if value is not _MISSING:
            declared[name] = value
    return declared
