"""What an observation holds: pictures as asked for, their depth and calibration, proprioception."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from roboirg.core.actions import JOINT_HIGH, JOINT_LOW, POSE_SIZE
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import (
    DemonstrationFrames,
    check_cameras,
    check_demonstration_frames,
    check_observe_every,
)
from roboirg.simulation.proprioception import Proprioception
from roboirg.simulation.rendering.render_mode import FAITHFUL, Rendering
from roboirg.simulation.rendering.viewpoint import SIZE
from roboirg.simulation.world import World

_SLACK = 0.1
"""Radians by which joints may pass their limits while they are pushed."""


class ObservationSpec(NamedTuple):
    """Which fields observations have besides proprioception, and the video.

    Attributes:
        cameras: whose pictures.
        depth: whether with depth.
        calibration: whether with extrinsic and intrinsic matrices.
        demonstration_frames: which pictures the video has: all, none, or every n-th.
        observe_every: after how many control steps there is an observation in ``history``.
        history_cameras: whose pictures these have; None for those of `cameras`.
        rendering: how pictures are made.
    """

    cameras: Sequence[str]
    depth: bool = False
    calibration: bool = False
    demonstration_frames: DemonstrationFrames = "all"
    observe_every: int | None = None
    history_cameras: Sequence[str] | None = None
    rendering: Rendering = FAITHFUL

    @property
    def of_history(self) -> ObservationSpec:
        """What the observations in ``history`` hold."""
        cameras = self.cameras if self.history_cameras is None else self.history_cameras
        return self._replace(cameras=cameras)

    def checked(self) -> ObservationSpec:
        """These wishes, if they can be fulfilled.

        Raises:
            UnknownNameError: there is no such camera.
            InvalidValueError: depth or calibration is wanted of no camera, or a number is none.
        """
        check_demonstration_frames(self.demonstration_frames)
        check_observe_every(self.observe_every)
        cameras = check_cameras(self.cameras)
        for camera in check_cameras(self.of_history.cameras):
            if camera not in cameras:
                raise InvalidValueError(
                    f"history_cameras has {camera!r}, but cameras is {cameras}; name it there too."
                )
        for name, wanted in (("depth", self.depth), ("calibration", self.calibration)):
            if not isinstance(wanted, bool):
                raise InvalidValueError(f"{name} is {wanted!r}; it has to be True or False.")
            if wanted and not cameras:
                raise InvalidValueError(
                    f"{name}=True is for the cameras asked for, and cameras is (); "
                    "name one, for example cameras=('front',)."
                )
        return self._replace(cameras=cameras)


class ObservationBuilder:
    """Reads one world.

    Args:
        world: to be followed from now on.
        wishes: what is read.

    Attributes:
        proprioception: what the robot feels.
    """

    def __init__(self, world: World, wishes: ObservationSpec) -> None:
        self._world = world
        self._wishes = wishes
        self._drawn = tuple(picture_space(wishes))
        self._drawn_before = tuple(picture_space(wishes.of_history))
        self.proprioception = Proprioception(world.robot)

    def read(self) -> dict[str, Any]:
        """The observation without the instruction."""
        return self._read(self._wishes.cameras, self._drawn)

    def recall(self) -> dict[str, Any]:
        """The same as ``history`` will hold it."""
        return self._read(self._wishes.of_history.cameras, self._drawn_before)

    def _read(self, cameras: Sequence[str], drawn: Sequence[str]) -> dict[str, Any]:
        if drawn:
            # All cameras begin before the first picture is waited for.
            self._world.cameras.draw(cameras)
        return {**{field: draw(self._world, field) for field in drawn}, **self.feel()}

    def feel(self) -> dict[str, Any]:
        """The part of the observation for which nothing is drawn."""
        fields: dict[str, Any] = {}
        for camera in self._wishes.cameras if self._wishes.calibration else ():
            fields[f"{camera}_extrinsic"] = self._world.cameras.extrinsic(camera)
            fields[f"{camera}_intrinsic"] = self._world.cameras.intrinsic(camera)
        return {**fields, **self.proprioception.read()}


def draw(world: World, field: str) -> NDArray[Any]:
    """A field such as ``"front_rgb"`` of the world as it is now."""
    camera, _, kind = field.rpartition("_")
    return _DRAWN[kind](world, camera)


_DRAWN: Mapping[str, Callable[[World, str], NDArray[Any]]] = {
    "rgb": lambda world, camera: world.picture(camera),
    "depth": lambda world, camera: world.cameras.depth(camera),
}


def picture_space(wishes: ObservationSpec) -> dict[str, spaces.Space[Any]]:
    """The space of each field that has to be drawn."""
    fields: dict[str, spaces.Space[Any]] = {
        f"{camera}_rgb": spaces.Box(0, 255, (SIZE, SIZE, 3), np.uint8) for camera in wishes.cameras
    }
    millimeters = np.iinfo(np.int16)
    for camera in wishes.cameras if wishes.depth else ():
        fields[f"{camera}_depth"] = spaces.Box(
            int(millimeters.min), int(millimeters.max), (SIZE, SIZE, 1), np.int16
        )
    return fields


def proprioception_space(wishes: ObservationSpec) -> dict[str, spaces.Space[Any]]:
    """The space of each field that `ObservationBuilder.feel` gives."""
    fields: dict[str, spaces.Space[Any]] = {}
    for camera in wishes.cameras if wishes.calibration else ():
        fields[f"{camera}_extrinsic"] = spaces.Box(-np.inf, np.inf, (3, 4), np.float32)
        fields[f"{camera}_intrinsic"] = spaces.Box(-np.inf, np.inf, (3, 3), np.float32)
    low, high = (JOINT_LOW - _SLACK).astype(np.float32), (JOINT_HIGH + _SLACK).astype(np.float32)
    return {
        **fields,
        "joint_positions": spaces.Box(low, high),
        "gripper": spaces.Box(-0.01, 0.05, (2,), np.float32),
        "end_effector": spaces.Box(-np.inf, np.inf, (POSE_SIZE,), np.float64),
    }


def observation_space(wishes: ObservationSpec) -> dict[str, spaces.Space[Any]]:
    """The space of each field that `ObservationBuilder.read` gives."""
    return {**picture_space(wishes), **proprioception_space(wishes)}


def history_space(wishes: ObservationSpec) -> dict[str, spaces.Space[Any]]:
    """The space of each field that `ObservationBuilder.recall` gives."""
    return {**picture_space(wishes.of_history), **proprioception_space(wishes)}


def stack_proprioception(
    moments: Sequence[dict[str, Any]], wishes: ObservationSpec
) -> dict[str, NDArray[Any]]:
    """What `ObservationBuilder.feel` gave, as arrays with a leading axis T, which may be 0."""
    return {
        key: np.stack([moment[key] for moment in moments]) if moments else _empty(space)
        for key, space in proprioception_space(wishes).items()
    }


def _empty(space: spaces.Space[Any]) -> NDArray[Any]:
    return np.zeros((0, *(space.shape or ())), dtype=space.dtype)
