"""Stages in the videos of several tasks."""

from __future__ import annotations

from roboirg.core.conditions import Fact
from roboirg.core.episode import Primitive, Stage

RETREAT_STEPS = 20
"""Control steps for which the hand waits away from the objects (RoboMME)."""


def show_pick(cube: str) -> Stage:
    """Return the stage in which the video shows a cube picked up."""
    return Stage(
        expects=Fact("picked", cube),
        forbids=(),
        primitive=Primitive("pick_cube", cube),
        subgoal="pick up the cube {at}",
        points_at=cube,
    )


def retreat() -> Stage:
    """Return the stage in which the hand moves away from the objects and waits there."""
    return _static(Primitive("retreat", "robot", steps=RETREAT_STEPS))


def hold_still(steps: int) -> Stage:
    """Return the stage in which the robot holds still for a number of control steps."""
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
    """Return the stage after the video in which the robot goes to the policy's start pose."""
    return Stage(
        expects=Fact("home", "robot"),
        forbids=(),
        primitive=Primitive("go_home", "robot"),
        subgoal="go home",
        in_video=False,
    )
