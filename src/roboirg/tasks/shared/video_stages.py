"""Stages that the videos of several tasks show."""

from __future__ import annotations

from roboirg.core.conditions import Fact
from roboirg.core.episode import Primitive, Stage

RETREAT_STEPS = 20
"""How long the hand waits where it is in nobody's way, control steps (RoboMME)."""


def show_pick(cube: str) -> Stage:
    """In the video the cube is picked up."""
    return Stage(
        expects=Fact("picked", cube),
        forbids=(),
        primitive=Primitive("pick_cube", cube),
        subgoal="pick up the cube {at}",
        points_at=cube,
    )


def retreat() -> Stage:
    """In the video the hand leaves the table's things and waits there."""
    return _static(Primitive("retreat", "robot", steps=RETREAT_STEPS))


def hold_still(steps: int) -> Stage:
    """In the video the robot stays where it is for so many control steps."""
    return _static(Primitive("hold", "robot", steps=steps))


def _static(primitive: Primitive) -> Stage:
    return Stage(
        expects=Fact("still", "robot"),
        forbids=(),
        primitive=primitive,
        subgoal="static",
        lasting=primitive.steps,
    )


def go_home() -> Stage:
    """After the video, unseen, the robot goes where the policy takes over."""
    return Stage(
        expects=Fact("home", "robot"),
        forbids=(),
        primitive=Primitive("go_home", "robot"),
        subgoal="go home",
        recorded=False,
    )
