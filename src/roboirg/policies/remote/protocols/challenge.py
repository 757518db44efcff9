"""challenge://host:port: servers for the RoboMME challenge.

A request holds everything seen since the last one; the server decides how many actions it returns,
and all are executed. The protocol has no parts: the video is one message.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import Actions
from roboirg.core.observations import CAMERAS, Demonstration, Observation
from roboirg.policies.remote.endpoints import ActionSpaceName, RemoteOptions
from roboirg.policies.remote.protocols import Protocol
from roboirg.policies.remote.remote_policy import RemotePolicy
from roboirg.policies.remote.service import Message, Service

FIELDS = {
    "front_rgb_list": "front_rgb",
    "wrist_rgb_list": "wrist_rgb",
    "joint_state_list": "joint_positions",
    "eef_state_list": "end_effector",
    "gripper_state_list": "gripper",
}
"""The challenge's names of lists, and our fields."""
DEPTH_FIELDS = {f"{camera}_depth_list": f"{camera}_depth" for camera in CAMERAS}
"""With ``depth``: int16 (H, W, 1), mm."""
EXTRINSIC_FIELDS = {f"{camera}_camera_extrinsic_list": f"{camera}_extrinsic" for camera in CAMERAS}
"""With ``calibration``: float32 (3, 4), from the world's frame to the camera's."""
INTRINSIC_FIELDS = {f"{camera}_camera_intrinsic": f"{camera}_intrinsic" for camera in CAMERAS}
"""With ``calibration``: one float32 (3, 3) for the whole message, not a list."""


class ChallengeOptions(RemoteOptions):
    """Options of challenge://.

    Attributes:
        actions: action space of the submission.
        depth: whether to send depth.
        calibration: whether to send the cameras' matrices.
    """

    actions: ActionSpaceName = "joint_angle"
    depth: bool = False
    calibration: bool = False


class ChallengePolicy(RemotePolicy):
    """Client of a RoboMME challenge server."""

    options_type: ClassVar[type[RemoteOptions]] = ChallengeOptions
    options: ChallengeOptions
    observe_every: ClassVar[int] = 1

    def __init__(self, url: str, seed: int = 0) -> None:
        """Check URL and options; choose the fields that requests have."""
        super().__init__(url, seed)
        self.depth = self.options.depth
        self.calibration = self.options.calibration
        self._fields = dict(FIELDS)
        if self.depth:
            self._fields.update(DEPTH_FIELDS)
        if self.calibration:
            self._fields.update(EXTRINSIC_FIELDS)

    def begin_episode(self, demonstration: Demonstration) -> None:  # noqa: ARG002
        """Reset the server; the demonstration goes with the first request for actions."""
        self.request_confirmed({"reset": True}, "reset_finished")

    def request_actions(self, observation: Observation) -> Actions:
        """Send everything seen since the last call; return all actions of the reply.

        The first call of an episode sends the demonstration and the observation, later ones the
        history.
        """
        demonstration = self.take_demonstration()
        is_first_step = demonstration is not None
        seen: Sequence[Observation] = (observation,)
        if not is_first_step and observation["history"]:
            seen = observation["history"]

        message: dict[str, Any] = {
            "task_goal": [self.instruction],
            "is_first_step": is_first_step,
        }
        for name, field in self._fields.items():
            message[name] = _column(field, demonstration, seen)
        if self.calibration:
            for name, field in INTRINSIC_FIELDS.items():
                message[name] = observation[field]  # type: ignore[literal-required]
        return self.read_actions(self.request(message))


class ChallengeService(Service):
    """Answers ``reset`` and requests for actions; all connections share a memory."""

    _steps = 0

    def handle(self, message: Message) -> dict[str, Any]:
        """Return the reply to a reset or a request for actions.

        The first request of an episode has the demonstration before its newest observation; later
        ones have what was seen since the last request, which becomes the observation's history.
        """
        if message.get("reset"):
            self.forget()
            return {"reset_finished": True}
        observations = _read_observations(message)
        newest = observations[-1]
        instruction = newest["instruction"]
        if message.get("is_first_step") or self.policy is None:
            self.forget()
            self.begin(instruction, _stack(observations))
            self._steps = 0
            newest["history"] = ()
        else:
            self._steps += len(observations)
            self.hear(instruction, self._steps)
            newest["history"] = tuple(cast("Observation", dict(seen)) for seen in observations)
        actions, _ = self.act(newest)
        return {"actions": actions}


def _column(
    field: str, demonstration: Demonstration | None, seen: Sequence[Observation]
) -> list[NDArray[Any]]:
    """Return a field of each video frame, if there is a video to send, and each observation."""
    video: Sequence[NDArray[Any]] = ()
    if demonstration is not None and len(demonstration["joint_positions"]):
        video = list(demonstration[field])
    return [*video, *(observation[field] for observation in seen)]  # type: ignore[literal-required]


def _read_observations(message: Message) -> list[Observation]:
    """Return the observations in a request, oldest first.

    A list of the request has a field of all observations: ``front_rgb_list`` the front pictures.
    """
    goals = message.get("task_goal")
    if not isinstance(goals, list) or not goals or not isinstance(goals[0], str):
        raise ValueError("'task_goal' must be a list of texts.")
    # What a request has once is the same in all observations.
    in_all: dict[str, Any] = {"instruction": goals[0]}
    for name, field in INTRINSIC_FIELDS.items():
        if name in message:
            in_all[field] = message[name]

    columns = _read_columns(message)
    observations: list[Any] = []
    for values in zip(*columns.values(), strict=True):
        observation = dict(zip(columns, values, strict=True))
        observations.append(observation | in_all)
    return observations


def _read_columns(message: Message) -> dict[str, list[Any]]:
    """Return the lists in a request by our names of the fields, all of the same length.

    ``front_rgb_list`` becomes ``front_rgb``. Depth and matrices are optional.

    Raises:
        ValueError: a field is missing, no list, empty, or of another length.
    """
    fields = dict(FIELDS)
    for name, field in (DEPTH_FIELDS | EXTRINSIC_FIELDS).items():
        if name in message:
            fields[name] = field
    columns = {field: message.get(name) for name, field in fields.items()}
    # What is no list counts as an empty one.
    lengths = {len(column) if isinstance(column, list) else 0 for column in columns.values()}
    if len(lengths) > 1 or 0 in lengths:
        raise ValueError(f"{', '.join(fields)} must be lists of the same length, at least 1.")
    return cast("dict[str, list[Any]]", columns)


def _stack(observations: list[Observation]) -> dict[str, Any]:
    """Return all observations but the last as a demonstration: by field, an array (T, …).

    Without any before the last, T is 0.
    """
    demonstration: dict[str, Any] = {}
    for field in observations[0]:
        if field != "instruction":
            values = [observation[field] for observation in observations]  # type: ignore[literal-required]
            demonstration[field] = np.stack(values)[:-1]
    return demonstration


PROTOCOL = Protocol(
    name="challenge",
    client=ChallengePolicy,
    service=ChallengeService,
)
