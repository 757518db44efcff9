"""challenge://host:port: servers for the RoboMME challenge.

A request holds everything seen since the last one; the server decides how many actions it returns,
and all are executed. The protocol has no parts: the video is one message.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import Actions
from roboirg.core.observations import CAMERAS, Demonstration, Observation
from roboirg.policies.remote.endpoints import ActionSpaceName, RemoteOptions
from roboirg.policies.remote.protocols import Protocol
from roboirg.policies.remote.remote_policy import RemotePolicy
from roboirg.policies.remote.service import Message, Service

FIELDS: Mapping[str, str] = {
    "front_rgb_list": "front_rgb",
    "wrist_rgb_list": "wrist_rgb",
    "joint_state_list": "joint_positions",
    "eef_state_list": "end_effector",
    "gripper_state_list": "gripper",
}
"""The challenge's names of lists, and our fields."""
DEPTH_FIELDS: Mapping[str, str] = {f"{camera}_depth_list": f"{camera}_depth" for camera in CAMERAS}
"""With ``depth``: int16 (H, W, 1), mm."""
EXTRINSIC_FIELDS: Mapping[str, str] = {
    f"{camera}_camera_extrinsic_list": f"{camera}_extrinsic" for camera in CAMERAS
}
"""With ``calibration``: float32 (3, 4), from the world's frame to the camera's."""
INTRINSIC_FIELDS: Mapping[str, str] = {
    f"{camera}_camera_intrinsic": f"{camera}_intrinsic" for camera in CAMERAS
}
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
        super().__init__(url, seed)
        self.depth, self.calibration = self.options.depth, self.options.calibration
        self._fields = {
            **FIELDS,
            **(DEPTH_FIELDS if self.depth else {}),
            **(EXTRINSIC_FIELDS if self.calibration else {}),
        }
        self._demonstration: Demonstration | None = None

    def begin_episode(self, demonstration: Demonstration) -> None:
        """Reset the server; the demonstration goes with the first request for actions."""
        self._demonstration = demonstration
        self.request_confirmed({"reset": True}, "reset_finished")

    def request_actions(self, observation: Observation) -> Actions:
        """Send everything seen since the last call; return all actions of the reply."""
        intrinsic = INTRINSIC_FIELDS if self.calibration else {}
        demonstration, self._demonstration = self._demonstration, None
        first = demonstration is not None
        seen = (observation,) if first else observation["history"] or (observation,)
        message = {
            "task_goal": [self.instruction],
            "is_first_step": first,
            **{name: _column(field, demonstration, seen) for name, field in self._fields.items()},
            **{name: observation[field] for name, field in intrinsic.items()},  # type: ignore[literal-required]
        }
        return self.read_actions(self.request(message))


class ChallengeService(Service):
    """Answers ``reset`` and requests for actions; all connections share a memory."""

    _steps = 0

    def handle(self, message: Message) -> dict[str, Any]:
        """Return the reply to a reset or a request for actions."""
        if message.get("reset"):
            self.forget()
            return {"reset_finished": True}
        observations = _read_observations(message)
        now = observations[-1]
        if message.get("is_first_step") or self.policy is None:
            self.forget()
            self.begin(now["instruction"], _stack(observations))
            self._steps = 0
            now["history"] = ()
        else:
            self._steps += len(observations)
            self.hear(now["instruction"], self._steps)
            now["history"] = tuple(cast("Observation", dict(seen)) for seen in observations)
        actions, _ = self.act(now)
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

    Depth and matrices are read if the client sends them.
    """
    goals = message.get("task_goal")
    if not isinstance(goals, list) or not goals or not isinstance(goals[0], str):
        raise ValueError("'task_goal' must be a list of texts.")
    optional = {**DEPTH_FIELDS, **EXTRINSIC_FIELDS}
    names = {**FIELDS, **{name: optional[name] for name in optional if name in message}}
    columns = {field: message.get(name) for name, field in names.items()}
    lengths = {len(column) if isinstance(column, list) else 0 for column in columns.values()}
    if len(lengths) > 1 or 0 in lengths:
        raise ValueError(f"{', '.join(names)} must be lists of the same length, at least 1.")
    same = {field: message[name] for name, field in INTRINSIC_FIELDS.items() if name in message}
    found: list[Any] = [
        {**dict(zip(columns, values, strict=True)), **same, "instruction": goals[0]}
        for values in zip(*(column or () for column in columns.values()), strict=True)
    ]
    return found


def _stack(observations: list[Observation]) -> dict[str, Any]:
    """Return all observations but the last as a demonstration."""
    return {
        field: np.stack([one[field] for one in observations])[:-1]  # type: ignore[literal-required]
        for field in observations[0]
        if field != "instruction"
    }


PROTOCOL = Protocol(
    name="challenge",
    client=ChallengePolicy,
    service=ChallengeService,
)
