"""Observations: pictures, depth, calibration and proprioception."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import JOINT_LOW, POSE_SIZE
from roboirg.core.environment_options import DemonstrationFrames
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import PICTURE_SIZE
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.simulation.proprioception import Proprioception
from roboirg.simulation.rendering.render_settings import FAITHFUL, RenderSettings
from roboirg.simulation.world import World


@dataclass(frozen=True)
class ObservationSpec:
    """Fields of observations and of the video besides proprioception.

    Attributes:
        cameras: cameras whose pictures are included.
        depth: whether depth is included.
        calibration: whether extrinsic and intrinsic matrices are included.
        demonstration_frames: pictures in the video: all, none, or every n-th.
        observe_every: control steps from one observation in ``history`` to the next.
        history_cameras: cameras in the history; None for `cameras`.
        rendering: how pictures are drawn.
    """

    cameras: Sequence[str]
    depth: bool = False
    calibration: bool = False
    demonstration_frames: DemonstrationFrames = "all"
    observe_every: int | None = None
    history_cameras: Sequence[str] | None = None
    rendering: RenderSettings = FAITHFUL

    @property
    def for_history(self) -> ObservationSpec:
        """The spec of the observations in ``history``."""
        if self.history_cameras is None:
            return self
        return replace(self, cameras=self.history_cameras)

    def validated(self) -> ObservationSpec:
        """Return this spec, with the cameras as a tuple, if it is valid."""
        fields = dict(vars(self))
        del fields["rendering"]
        needs = PolicyNeeds(**fields)  # which checks them
        for camera in needs.history_cameras or ():
            if camera not in needs.cameras:
                raise InvalidValueError(
                    f"history_cameras has {camera!r}, but cameras is {needs.cameras}; add it there."
                )
        return replace(self, cameras=needs.cameras)


class ObservationBuilder:
    """Reads observations of one world.

    Args:
        world: the world.
        spec: which fields observations have.

    Attributes:
        proprioception: the robot's proprioception; its `update` is called after each control step.
    """

    def __init__(self, world: World, spec: ObservationSpec) -> None:
        self._world = world
        self._spec = spec
        self._picture_fields = tuple(picture_fields(spec))
        self._history_picture_fields = tuple(picture_fields(spec.for_history))
        self.proprioception = Proprioception(world.robot)

    def read(self) -> dict[str, Any]:
        """Return the current observation without the instruction."""
        return {**self.read_pictures(self._picture_fields), **self.read_proprioception()}

    def read_history_entry(self) -> dict[str, Any]:
        """Return the current observation for ``history``, without the instruction."""
        pictures = self.read_pictures(self._history_picture_fields)
        return {**pictures, **self.read_proprioception()}

    def read_pictures(self, fields: Sequence[str]) -> dict[str, NDArray[Any]]:
        """Return the given fields that are drawn, for example ``front_rgb``."""
        if fields:
            # All cameras start drawing before the first picture is fetched.
            self._world.cameras.draw(cameras_of(fields))
        return {field: read_picture(self._world, field) for field in fields}

    def read_proprioception(self) -> dict[str, Any]:
        """Return the observation fields that need no drawing: proprioception and calibration."""
        fields: dict[str, Any] = {}
        if self._spec.calibration:
            for camera in self._spec.cameras:
                fields[f"{camera}_extrinsic"] = self._world.cameras.extrinsic(camera)
                fields[f"{camera}_intrinsic"] = self._world.cameras.intrinsic(camera)
        return {**fields, **self.proprioception.read()}


def cameras_of(picture_fields: Iterable[str]) -> tuple[str, ...]:
    """Return the cameras of fields, each once: of ``front_rgb`` and ``front_depth``, ``front``."""
    cameras = [field.rpartition("_")[0] for field in picture_fields]
    return tuple(dict.fromkeys(cameras))


def read_picture(world: World, field: str) -> NDArray[Any]:
    """Return a picture field of the current world, for example ``"front_rgb"``."""
    camera, _, kind = field.rpartition("_")
    return _PICTURE_READERS[kind](world, camera)


_PICTURE_READERS: Mapping[str, Callable[[World, str], NDArray[Any]]] = {
    "rgb": lambda world, camera: world.picture(camera),
    "depth": lambda world, camera: world.cameras.depth(camera),
}


class FieldFormat(NamedTuple):
    """Shape and type of one reading of a field."""

    shape: tuple[int, ...]
    dtype: type[np.generic]


def picture_fields(spec: ObservationSpec) -> dict[str, FieldFormat]:
    """Return the format of each field that is drawn."""
    formats = {}
    for camera in spec.cameras:
        formats[f"{camera}_rgb"] = FieldFormat((PICTURE_SIZE, PICTURE_SIZE, 3), np.uint8)
    if spec.depth:
        for camera in spec.cameras:
            formats[f"{camera}_depth"] = FieldFormat((PICTURE_SIZE, PICTURE_SIZE, 1), np.int16)
    return formats


def proprioception_fields(spec: ObservationSpec) -> dict[str, FieldFormat]:
    """Return the format of each field of `ObservationBuilder.read_proprioception`."""
    formats = {}
    if spec.calibration:
        for camera in spec.cameras:
            formats[f"{camera}_extrinsic"] = FieldFormat((3, 4), np.float32)
            formats[f"{camera}_intrinsic"] = FieldFormat((3, 3), np.float32)
    formats["joint_positions"] = FieldFormat(JOINT_LOW.shape, np.float32)
    formats["gripper"] = FieldFormat((2,), np.float32)
    formats["end_effector"] = FieldFormat((POSE_SIZE,), np.float64)
    return formats


def stack_proprioception(
    readings: Sequence[dict[str, Any]], spec: ObservationSpec
) -> dict[str, NDArray[Any]]:
    """Stack readings of `read_proprioception` to arrays with a leading axis T >= 0.

    Args:
        readings: T of them; without any, arrays are empty, with the right shapes and types.
        spec: which fields they have.
    """
    arrays = {}
    for field, kind in proprioception_fields(spec).items():
        if readings:
            arrays[field] = np.stack([reading[field] for reading in readings])
        else:
            arrays[field] = np.zeros((0, *kind.shape), kind.dtype)
    return arrays
