"""The moves that the expert makes, and the waypoint of a move.

A waypoint is a pose of the tool with what the gripper does there. A move is a type of waypoint: it
says where the pose is from an object, or from the tool, so that few moves stand for all waypoints.
"Above the object, turned along its side" is a move; with an object it becomes a waypoint.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.sight import ExpertRecording

Z_GRID = 0.0025
"""Meters to which heights are rounded."""
HOME = (math.pi, 0.0, 0.0)
"""Roll, pitch and yaw of the tool at the beginning, rad."""
STAY = "stay"
"""Turn of a tool that does not move at all while the gripper opens or closes."""
KEEP = "keep"
"""Turn of a tool that keeps its rotation."""
ALIGN = "align"
"""Turn of a tool that aligns with a side of the object. Another turn, *home*, is to `HOME`."""
GRIPPER_UNCHANGED = 0.0
"""Gripper value of a waypoint that neither opens nor closes it."""
XY_GRID = 0.1
"""Meters to which an offset in the plane from the tool is rounded."""
NO_LABEL = -1
"""In the place of a move, track, count or time that a network does not learn at a look."""
LEAST_SHARE = 0.0005
"""Share of all waypoints; moves that are rarer are not learned."""


class Move(NamedTuple):
    """A type of waypoint; trained files have the fields in this order.

    Attributes:
        at_object: whether x and y are from an object; else from the tool.
        x: from there, m.
        y: from there, m.
        z: of the tool above the table, m; 0 if it stays.
        turn: how the tool turns: `KEEP`, `ALIGN`, ``home`` or `STAY`.
        gripper: -1 closes it, 1 opens it, 0 leaves it.
    """

    at_object: bool
    x: float
    y: float
    z: float
    turn: str
    gripper: float


class LookDecision(NamedTuple):
    """A decision to learn, made at one look.

    Attributes:
        look: number of the look in the recording.
        move: the `Move`, or for planners the `SubgoalTemplate`.
        object_number: the recording's number of the object that the move is at, or that the subgoal
            points at; -1 for none.
    """

    look: int
    move: Any
    object_number: int


def decisions_of(recorded: ExpertRecording) -> list[LookDecision]:
    """Return what the expert decided in an episode: moves, each with look and object.

    The expert moves, and then opens or closes the gripper in a waypoint of its own. Here both are
    one decision: the move's, with the gripper's value. "Down" and "close" → "down and close".
    """
    decisions: list[LookDecision] = []
    for number, look in enumerate(recorded.looks.tolist()):
        move = _move_of(recorded, number)
        follows_move = bool(decisions) and decisions[-1].move.gripper == GRIPPER_UNCHANGED
        if move.gripper != GRIPPER_UNCHANGED and follows_move:
            _set_gripper_at_end(decisions, move.gripper)
        else:
            decisions.append(LookDecision(look, move, int(recorded.anchors[number])))
    return decisions


def _move_of(recorded: ExpertRecording, number: int) -> Move:
    """Return the move of the waypoint with a number in a recording.

    One that opens or closes the gripper stays in place. At an object only the height is kept; else
    also the offset from the tool, both rounded so that few moves occur.
    """
    look = recorded.looks[number]
    action = recorded.actions[number]
    at_object = bool(recorded.anchors[number] >= 0)
    gripper = float(action[-1])
    if gripper != GRIPPER_UNCHANGED:
        return Move(at_object, 0.0, 0.0, 0.0, STAY, gripper)
    from_tool_at_table = np.append(recorded.tool[look, :2], 0.0)
    x, y, z = action[:3] - from_tool_at_table  # x and y from the tool, z above the table, m
    height = _round(z, Z_GRID)
    turn = recorded.turns[number]
    if at_object:
        return Move(at_object, 0.0, 0.0, height, turn, gripper)
    return Move(at_object, _round(x, XY_GRID), _round(y, XY_GRID), height, turn, gripper)


def _set_gripper_at_end(decisions: list[LookDecision], gripper: float) -> None:
    """Set the gripper's value in the last decision, and in repetitions of it just before.

    A move that could not be made is decided again at the next look, and so is listed several times.

    Args:
        decisions: those so far, at least one, which are changed in place.
        gripper: -1 closes it, 1 opens it.
    """
    last = decisions[-1]
    for number in reversed(range(len(decisions))):
        decision = decisions[number]
        is_same = decision.move == last.move and decision.object_number == last.object_number
        if not is_same:
            break
        decisions[number] = decision._replace(move=decision.move._replace(gripper=gripper))


def common_moves(decisions: Iterable[Sequence[LookDecision]]) -> tuple[Move, ...]:
    """Return the moves that make up at least `LEAST_SHARE` of all, the commonest first.

    A move's place is its number in trained networks.

    Args:
        decisions: of each episode.
    """
    counts: Counter[Move] = Counter()
    for decisions_of_episode in decisions:
        counts.update(decision.move for decision in decisions_of_episode)
    least_count = LEAST_SHARE * counts.total()
    return tuple(move for move, count in counts.most_common() if count >= least_count)


def waypoint(
    move: Move,
    tool: NDArray[np.floating],
    position: NDArray[np.floating],
    yaw_code: NDArray[np.floating],
) -> NDArray[np.float64]:
    """Return the waypoint of a move: x, y, z, m, roll, pitch, yaw, rad, and gripper, (7,).

    Args:
        move: what is done there.
        tool: (6,) or more: x, y, z, m, roll, pitch, yaw, rad, of the tool now.
        position: (2,) x and y of the object, m; ignored unless the move is at one.
        yaw_code: (2,) of the object, as `encode_yaws` returns it; ignored unless the tool aligns.
    """
    if move.turn == STAY:
        return np.append(tool[:6], move.gripper)
    x, y = position if move.at_object else tool[:2]
    roll, pitch, yaw = HOME
    if move.turn == KEEP:
        roll, pitch, yaw = tool[3:6]
    elif move.turn == ALIGN:
        angle = math.atan2(yaw_code[1], yaw_code[0]) / 4.0
        yaw = _nearest_side(angle, float(tool[5]))
    return np.array([x + move.x, y + move.y, move.z, roll, pitch, yaw, move.gripper], np.float64)


def _nearest_side(angle: float, now: float) -> float:
    """Return the angle, rad, of that side of a square object to which the tool turns least.

    Sides are a quarter turn apart: side 0.1 and yaw 1.5 → 0.1 + π/2.

    Args:
        angle: of one of its sides, rad.
        now: the yaw of the tool, rad.
    """
    quarter = math.pi / 2.0
    return angle + quarter * round((now - angle) / quarter)


def _round(value: float, grid: float) -> float:
    """Return the nearest multiple of a grid, never -0: 0.0374 on a grid of 0.0025 → 0.0375."""
    return round(round(float(value) / grid) * grid, 4) + 0.0
