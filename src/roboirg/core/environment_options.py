"""The options that select how the environment of an episode is played."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields
from typing import Any, Literal, TypedDict

from roboirg.core.actions import find_action_space
from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.field_types import Label, Whole, check_whole, described

MAX_STEPS = 1300
"""Control steps a policy has, as in RoboMME's published experiments."""
DEFAULT_MESHES = "faithful"
MESHES = (DEFAULT_MESHES, "light")

DemonstrationFrames = Literal["all", "none"] | int
"""Which frames of the video are included: all, none, or every n-th, the first included."""


@dataclass(frozen=True, slots=True)
class EnvironmentOptions:
    """The options of an environment that do not choose its words.

    Plans, environments, jobs and records take their options of environments from these fields.

    Attributes:
        actions: joint_angle, ee_pose, waypoint or choice.
        observe_every: n adds `history` to each observation: the observations after every n-th
            control step since the last one.
        meshes: those of ``light`` make pictures faster, which differ slightly from RoboMME's.
    """

    max_steps: Whole = field(
        default=MAX_STEPS,
        metadata=described("Limit of an episode in control steps, 20 per second."),
    )
    actions: Label | None = field(
        default=None,
        metadata=described("Required action space; without one, each policy's own."),
    )
    demonstration_frames: DemonstrationFrames | None = field(
        default=None,
        metadata=described(
            "Frames of the demonstration that policies get: all, none, or n for every n-th; "
            "without it, as each policy asks."
        ),
    )
    observe_every: Whole | None = field(
        default=None,
        metadata=described(
            "Control steps between two observations; without it, as each policy asks."
        ),
    )
    meshes: Label = field(
        default=DEFAULT_MESHES, metadata=described("Meshes for rendering: faithful or light.")
    )

    @property
    def prescribed(self) -> dict[str, Any]:
        """The values by name, without those that are left to the policy."""
        return {name: value for name, value in asdict(self).items() if value is not None}

    def check(self) -> None:
        """Raise if a value is invalid.

        Raises:
            UnknownNameError: there is no such action space or kind of meshes.
            InvalidValueError: a number is out of range.
        """
        check_whole("max_steps", self.max_steps)
        if self.actions is not None:
            find_action_space(self.actions)
        if self.demonstration_frames is not None:
            check_demonstration_frames(self.demonstration_frames)
        check_observe_every(self.observe_every)
        check_names("kind of meshes", [self.meshes], MESHES)


class EnvironmentKeywords(TypedDict, total=False):
    """The fields of `EnvironmentOptions` as keyword arguments."""

    max_steps: int
    actions: str
    demonstration_frames: DemonstrationFrames
    observe_every: int | None
    meshes: str


ENVIRONMENT_OPTIONS = tuple(option.name for option in fields(EnvironmentOptions))
"""The names of all options."""


def check_demonstration_frames(value: object) -> DemonstrationFrames:
    """Return a value as a choice of frames of the video, or raise an error.

    ``"all"``, ``"none"``, or n >= 1 for every n-th frame.

    Raises:
        InvalidValueError: it is none of these.
    """
    if value in ("all", "none"):
        return value
    if type(value) is not int:
        raise InvalidValueError(
            f"demonstration_frames is {value!r}; it must be 'all', 'none' or a whole number of at "
            "least 1."
        )
    return check_whole("demonstration_frames", value)


def check_observe_every(value: object) -> int | None:
    """Return a value as the number of control steps between observations within a chunk.

    Raises:
        InvalidValueError: it is neither None nor a whole number from 1 on.
    """
    if value is None:
        return None
    return check_whole("observe_every", value)
