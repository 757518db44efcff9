"""The kinds of waypoints that the expert makes, and the waypoint of a kind at a place.

A waypoint is a pose of the tool with what the gripper does there. Its kind says where that is from
a thing, or from the tool, so that few kinds stand for all waypoints.
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
"""The turn of a tool that stays where it is while the gripper opens or closes."""
GRIPPER_UNCHANGED = 0.0
"""Gripper value of a waypoint that neither opens nor closes it."""
XY_GRID = 0.1
"""Meters to which a way in the plane from the tool's place is rounded."""
LEAST_SHARE = 0.0005
"""Share of all waypoints; kinds of waypoints that are rarer are not learned."""


class Move(NamedTuple):
    """A kind of waypoint.

    Attributes:
        at_thing: whether it is at the place of a thing; else at that of the tool.
        x: from there, m.
        y: from there, m.
        z: of the tool, m; 0 if it stays.
        turn: how the tool turns: keep, align, home; stay if it does not move at all.
        gripper: -1 closes it, 1 opens it, 0 leaves it.
    """

    at_thing: bool
    x: float
    y: float
    z: float
    turn: str
    gripper: float


class LookDecision(NamedTuple):
    """A decision to learn.

    Attributes:
        look: number of the look at which it is made.
        move: the kind of waypoint, or the form of the subgoal.
        thing: number of the object at whose place it is, or at which the subgoal points; -1 for
            none: then the waypoint is at the tool's place.
    """

    look: int
    move: Any
    thing: int


def decisions_of(recorded: ExpertRecording) -> list[LookDecision]:
    """Return what the expert decided in an episode: kinds of waypoints, each with look and thing.

    The expert moves, and then opens or closes the gripper in a waypoint of its own. Here both are
    one decision: the move's, with the gripper's value.
    """
    found: list[LookDecision] = []
    for number, look in enumerate(recorded.looks.tolist()):
        move = _move_of(recorded, number)
        follows_move = bool(found) and found[-1].move.gripper == GRIPPER_UNCHANGED
        if move.gripper != GRIPPER_UNCHANGED and follows_move:
            _set_gripper_at_end(found, move.gripper)
        else:
            found.append(LookDecision(look, move, int(recorded.anchors[number])))
    return found


def _move_of(recorded: ExpertRecording, number: int) -> Move:
    """Return the kind of the waypoint with a number in a recording.

    One that opens or closes the gripper stays in place. At a thing only the height is kept; else
    also the way from the tool, both rounded so that few kinds occur.
    """
    look = recorded.looks[number]
    action = recorded.actions[number]
    at_thing = bool(recorded.anchors[number] >= 0)
    gripper = float(action[-1])
    if gripper != GRIPPER_UNCHANGED:
        return Move(at_thing, 0.0, 0.0, 0.0, STAY, gripper)
    # x and y from the tool, z above the table, m.
    x, y, z = action[:3] - np.append(recorded.tool[look, :2], 0.0)
    height = _round(z, Z_GRID)
    turn = recorded.turns[number]
    if at_thing:
        return Move(at_thing, 0.0, 0.0, height, turn, gripper)
    return Move(at_thing, _round(x, XY_GRID), _round(y, XY_GRID), height, turn, gripper)


def _set_gripper_at_end(found: list[LookDecision], gripper: float) -> None:
    """Set the gripper's value in the last decision, and in repetitions of it just before.

    A move that could not be made is decided again at the next look, and so is listed several times.

    Args:
        found: the decisions so far, which are changed in place.
        gripper: -1 closes it, 1 opens it.
    """
    last = found[-1]
    for number in reversed(range(len(found))):
        decision = found[number]
        is_same = decision.move == last.move and decision.thing == last.thing
        if not is_same:
            break
        found[number] = decision._replace(move=decision.move._replace(gripper=gripper))


def common_moves(decisions: Iterable[Sequence[LookDecision]]) -> tuple[Move, ...]:
    """Return the kinds of waypoints that make up at least `LEAST_SHARE`, the commonest first.

    Args:
        decisions: of each episode.
    """
    counts: Counter[Move] = Counter()
    for of_episode in decisions:
        counts.update(decision.move for decision in of_episode)
    least_count = LEAST_SHARE * counts.total()
    return tuple(move for move, count in counts.most_common() if count >= least_count)


def waypoint(
    move: Move,
    tool: NDArray[np.floating],
    place: NDArray[np.floating],
    turn: NDArray[np.floating],
) -> NDArray[np.float64]:
    """Return the waypoint of a kind: x, y, z, m, roll, pitch, yaw, rad, and gripper, (7,).

    Args:
        move: its kind; whether x and y are from the thing or from the tool.
        tool: (6,) x, y, z, m, roll, pitch, yaw, rad, of the tool now.
        place: (2,) x and y of the thing, m.
        turn: (2,) cosine and sine of four times the angle of the thing.
    """
    if move.turn == STAY:
        return np.append(tool[:6], move.gripper)
    x, y = place if move.at_thing else tool[:2]
    roll, pitch, yaw = HOME
    if move.turn == "keep":
        roll, pitch, yaw = tool[3:6]
    elif move.turn == "align":
        angle = math.atan2(turn[1], turn[0]) / 4.0
        yaw = _nearest_side(angle, float(tool[5]))
    return np.array([x + move.x, y + move.y, move.z, roll, pitch, yaw, move.gripper], np.float64)


def _nearest_side(angle: float, now: float) -> float:
    """Return the angle, rad, of that side of a square thing to which the tool turns least.

    Args:
        angle: of one of its sides, rad.
        now: the yaw of the tool, rad.
    """
    quarter = math.pi / 2.0
    return angle + quarter * round((now - angle) / quarter)


def _round(value: float, grid: float) -> float:
    """Return the nearest multiple of a grid, never -0: 0.0374 on a grid of 0.0025 is 0.0375."""
    return round(round(float(value) / grid) * grid, 4) + 0.0
