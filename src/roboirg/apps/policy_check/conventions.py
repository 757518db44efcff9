"""Conventions in which a policy may differ: how answers and observations are read instead.

Each is tried on moments of the expert's episode: if a policy's answers fit what the expert did far
better under another convention, that is the one it was trained with.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.policy_check.expert_episode import ExpertMoment
from roboirg.apps.policy_check.picture_formats import ChangeArray, change_pictures, to_floats
from roboirg.core.actions import ARM_JOINTS, EE_POSE, JOINT_ANGLE
from roboirg.core.episode import ROBOT_BASE
from roboirg.core.observations import CAMERAS

Chunk = NDArray[np.float64]
Fields = dict[str, Any]


class AnswerConvention(NamedTuple):
    """Another meaning of a policy's answers.

    Attributes:
        check: name of the check.
        space: name of the action space.
        read: returns the actions that a chunk means, for the moment at which it was given.
        means: how the answers fit better.
        remedy: what to change.
    """

    check: str
    space: str
    read: Callable[[Chunk, ExpertMoment], Chunk]
    means: str
    remedy: str


class InputConvention(NamedTuple):
    """Another form of observations.

    Attributes:
        check: name of the check.
        change: returns the fields of an observation, or of a demonstration, in that form.
        means: how the answers fit better.
        remedy: what to change.
        only_local: whether no protocol can carry it.
        cameras: how many the policy must ask for.
    """

    check: str
    change: Callable[[Fields], Fields]
    means: str
    remedy: str
    only_local: bool = False
    cameras: int = 1


def _scaled(columns: slice, factor: float) -> Callable[[Chunk, ExpertMoment], Chunk]:
    def read(chunk: Chunk, moment: ExpertMoment) -> Chunk:
        del moment
        scaled = chunk.copy()
        scaled[:, columns] *= factor
        return scaled

    return read


def _added(chunk: Chunk, moment: ExpertMoment) -> Chunk:
    still = moment.still
    return np.column_stack([chunk[:, : len(still)] + still, chunk[:, len(still) :]])


def _summed(chunk: Chunk, moment: ExpertMoment) -> Chunk:
    still = moment.still
    size = len(still)
    return np.column_stack([np.cumsum(chunk[:, :size], axis=0) + still, chunk[:, size:]])


def _from_base(chunk: Chunk, moment: ExpertMoment) -> Chunk:
    del moment
    moved = chunk.copy()
    moved[:, :3] += ROBOT_BASE
    return moved


def _pictures(change: ChangeArray) -> Callable[[Fields], Fields]:
    return lambda fields: change_pictures(fields, change)


def _swap_cameras(fields: Fields) -> Fields:
    one, other = (f"{camera}_rgb" for camera in CAMERAS)
    if one not in fields or other not in fields:
        return fields
    return {**fields, one: fields[other], other: fields[one]}


def _state_in_degrees(fields: Fields) -> Fields:
    return {**fields, "joint_positions": np.rad2deg(fields["joint_positions"])}


_ARM, _POSITION = slice(0, ARM_JOINTS), slice(0, 3)
_ABSOLUTE = "Add the joints of the observation, or train on absolute targets."

ANSWER_CONVENTIONS: tuple[AnswerConvention, ...] = (
    AnswerConvention(
        "joint units", JOINT_ANGLE.name, _scaled(_ARM, np.pi / 180), "as degrees",
        "Convert joint targets to radians.",
    ),
    AnswerConvention(
        "joint targets", JOINT_ANGLE.name, _added, "as changes of the joints that it was shown",
        _ABSOLUTE,
    ),
    AnswerConvention(
        "joint targets", JOINT_ANGLE.name, _summed, "as changes from row to row", _ABSOLUTE
    ),
    AnswerConvention(
        "tool position", EE_POSE.name, _added, "as changes of the pose that it was shown",
        "Add the pose of the observation.",
    ),
    AnswerConvention(
        "tool position", EE_POSE.name, _scaled(_POSITION, 0.001), "in millimeters",
        "Convert positions to meters.",
    ),
    AnswerConvention(
        "tool frame", EE_POSE.name, _from_base, "in the frame of the robot's base",
        f"Add the base's place in the world, {ROBOT_BASE} m.",
    ),
)  # fmt: skip

INPUT_CONVENTIONS: tuple[InputConvention, ...] = (
    InputConvention(
        "camera order", _swap_cameras, "with the pictures of the two cameras swapped",
        "Swap the keys under which they are read.", cameras=len(CAMERAS),
    ),
    InputConvention(
        "color order", _pictures(lambda one: one[..., ::-1]),
        "with blue, green, red instead of red, green, blue", "Reverse the channels before use.",
    ),
    InputConvention(
        "picture orientation", _pictures(lambda one: one[..., ::-1, ::-1, :]),
        "with pictures turned by 180 degrees", "Turn them before use.",
    ),
    InputConvention(
        "picture orientation", _pictures(lambda one: one[..., ::-1, :, :]),
        "with pictures upside down", "Flip them before use.",
    ),
    InputConvention(
        "picture range", _pictures(to_floats), "with pictures as floats from 0 to 1",
        "Divide them by 255 before use.", only_local=True,
    ),
    InputConvention(
        "state units", _state_in_degrees, "with joint positions in degrees",
        "Convert the observation's radians before use.", cameras=0,
    ),
)  # fmt: skip
