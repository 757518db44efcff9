"""A person as a policy: commands from the page become way points."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.people.driving_session import DrivingSession
from roboirg.core.actions import POSE_SIZE, REACH_HIGH, REACH_LOW, WAYPOINT
from roboirg.core.errors import InvalidValueError, MotionPlanningError
from roboirg.core.observations import CAMERAS, FRONT, Demonstration, Observation
from roboirg.util.media import CONTROL_RATE, Clip, encode_mp4

FRAMES_EVERY = 4
"""Control steps between two frames of the video."""
CARRY = 0.2
"""Height at which the hand moves over everything, m."""
LOWEST, HIGHEST = 0.004, 0.5
"""Limits of the tool's height above the table, m."""
MOST_STEP = 0.5
"""Meters of one move."""
LONGEST_WAIT_S = 10.0
GRIPS = {"open": 1.0, "close": -1.0}
LEAVE = 0.0
"""Gripper value that leaves it as it is."""


class DrivingPolicy:
    """Does what a person commands in the page.

    The person sees what any policy may see: both cameras, depth (to find the point that was clicked
    at) and the arm's own pose. Poses that the arm does not reach are refused before it moves.

    Args:
        session: shared with the page.
    """

    actions: ClassVar[str] = WAYPOINT.name
    cameras: ClassVar[tuple[str, ...]] = CAMERAS
    demonstration_frames: ClassVar[int] = FRAMES_EVERY
    depth: ClassVar[bool] = True
    calibration: ClassVar[bool] = True
    deterministic: ClassVar[bool] = False

    def __init__(self, session: DrivingSession) -> None:
        self._session = session
        self._pose: NDArray[np.float64] | None = None

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Show the video and the first words."""
        self._pose, video = None, None
        if len(demonstration["joint_positions"]):
            clip = Clip(demonstration[f"{FRONT}_rgb"], Fraction(CONTROL_RATE, FRAMES_EVERY))
            video = encode_mp4(clip)
        self._session.begin(instruction, video)

    def hear(self, text: str, step: int) -> None:  # noqa: ARG002
        """Show what has just been said."""
        self._session.say(text)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Wait for a command; return its way points.

        Raises:
            DrivingStoppedError: the person, or the server, has stopped.
        """
        if self._pose is None:
            self._pose = np.array(observation["end_effector"], dtype=np.float64)
        self._session.show_pictures({one: observation[f"{one}_rgb"] for one in CAMERAS})  # type: ignore[literal-required]
        while True:
            self._session.tell(height_cm=round(100 * float(self._pose[2]), 1))
            wanted = self._session.wait_command()
            try:
                rows = self._rows(wanted, self._pose.copy(), observation)
                self._check_reach(rows[-1])
            except (InvalidValueError, MotionPlanningError) as error:
                self._session.tell(message=f"Nothing moved: {error}")
                continue
            self._pose = rows[-1, :POSE_SIZE].copy()
            if wanted.get("grip") in GRIPS:
                self._session.tell(gripper="open" if wanted["grip"] == "open" else "closed")
            return rows

    def _rows(
        self, wanted: Mapping[str, Any], pose: NDArray[np.float64], seen: Observation
    ) -> NDArray[np.float64]:
        """Return the way points of a command, given at a pose, which changes to the commanded."""
        grip, count = LEAVE, 1
        match wanted:
            case {"move": [x, y, z]}:
                pose[:3] += [_number(one, MOST_STEP) for one in (x, y, z)]
            case {"turn": angle}:
                pose[5] = math.remainder(pose[5] + _number(angle, math.pi), 2 * math.pi)
            case {"height": meters}:
                pose[2] = _number(meters, HIGHEST)
            case {"point": [x, y]}:
                pose[:2] = _point_below(seen, _number(x, 255), _number(y, 255))[:2]
                pose[2] = CARRY
            case {"grip": "open" | "close" as how}:
                grip = GRIPS[how]
            case {"wait": seconds}:
                count = max(1, round(CONTROL_RATE * _number(seconds, LONGEST_WAIT_S)))
            case _:
                raise InvalidValueError("there is no such command.")
        pose[2] = min(max(pose[2], LOWEST), HIGHEST)
        return np.tile(np.append(pose, grip), (count, 1))

    def _check_reach(self, row: NDArray[np.float64]) -> None:
        """Raise if the arm does not get there: the episode would fail."""
        from roboirg.simulation.controllers import tool_pose
        from roboirg.simulation.expert.motion_planning import MotionPlanner

        if (row[:3] < REACH_LOW).any() or (row[:3] > REACH_HIGH).any():
            raise InvalidValueError("that point is out of the arm's reach.")
        env = self._session.env
        if env is None:
            raise RuntimeError("There is no environment.")
        robot = env.session.world.robot
        try:
            MotionPlanner(robot).plan_move(robot.arm_positions, tool_pose(row))
        except MotionPlanningError as error:
            raise InvalidValueError("the arm cannot reach that pose.") from error


def _point_below(seen: Observation, x: float, y: float) -> NDArray[np.float64]:
    """Return the point of the world that a pixel of the front picture shows, m."""
    depth = float(seen["front_depth"][int(y), int(x), 0]) / 1000
    if depth <= 0:
        raise InvalidValueError("there is nothing to point at.")
    direction = np.linalg.solve(seen["front_intrinsic"], [int(x) + 0.5, int(y) + 0.5, 1.0])
    matrix = np.asarray(seen["front_extrinsic"], dtype=np.float64)
    point = matrix[:, :3].T @ (depth * direction - matrix[:, 3])
    return np.asarray(point, dtype=np.float64)


def _number(value: object, most: float) -> float:
    """Return a finite number between plus and minus `most`."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= most:
        raise InvalidValueError(f"{value!r} is not a number up to {most:g}.")
    return float(value)
