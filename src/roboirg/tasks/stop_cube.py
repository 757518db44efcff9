"""StopCube: press the button so that the moving cube stops on the target on its n-th visit.

Counting suite. A cube without collisions moves back and forth over a target; every pass is one
visit. Difficulties do not differ. Facts: RoboMME, where the direction of the path depends on the
target's place; here it is drawn independently.
"""

from __future__ import annotations

import math

import numpy as np

from roboirg.core.conditions import All, Elapsed, Fact, OccurrenceCount, Rule, absent
from roboirg.core.episode import Difficulty, Goal, Primitive, Scene, SceneObject, Stage
from roboirg.core.footprints import Region
from roboirg.core.motions import Point, Shuttle
from roboirg.tasks.shared.fixtures import ORDINALS, draw_button
from roboirg.tasks.task import Commands, SceneAndGoal, Task, command_pools
from roboirg.util.random_draws import draw

BUTTON_REGION = Region(-0.2, 0.0, 0.05, 0.2)
TARGET_REGION = Region(0.0, 0.0, 0.1, 0.1)
TARGET_RADIUS = 0.036
TARGET_THICKNESS = 0.01
HEIGHT = 0.01
"""Height of the centers of the target and the cube, which is half sunk in the table, m."""
PATH_HALF = 0.3
"""Half the length of the cube's path, m; the target is in its middle."""
PATH_ANGLE = math.radians(30.0)
"""Largest angle between the path and the y axis, to either side."""
INTERVALS = (60, 80, 120)
"""Control steps of one pass."""
PASSES = 5
VISITS = range(2, PASSES + 1)
"""Visits that a goal can name; never the first."""
LEAD = 30
"""Control steps before the cube is on the target at which the oracle starts to press."""
CHECKPOINT = 100
"""Waiting is split into stages that end at multiples of this number of control steps."""


def sample(rng: np.random.Generator, _difficulty: Difficulty) -> SceneAndGoal:
    """Draw button, target and cube; speed, goal visit and direction of the path are uniform."""
    button = draw_button(rng, BUTTON_REGION)
    x, y = TARGET_REGION.draw(rng)
    target = SceneObject(
        "target",
        "target",
        Point(x, y, HEIGHT),
        radius=TARGET_RADIUS,
        thickness=TARGET_THICKNESS,
    )
    red, green, blue = rng.random(3).tolist()
    interval = draw(rng, INTERVALS)
    visit = int(rng.integers(VISITS.start, VISITS.stop))
    angle = (2.0 * rng.random() - 1.0) * PATH_ANGLE
    along_x, along_y = -PATH_HALF * math.sin(angle), PATH_HALF * math.cos(angle)
    begin = Point(x - along_x, y - along_y, HEIGHT)
    end = Point(x + along_x, y + along_y, HEIGHT)
    shuttle = SceneObject("shuttle", "shuttle", begin, rgb=(red, green, blue))
    run = Shuttle("shuttle", begin, end, interval, PASSES, stopped_by=Fact("pressed", "button"))
    return Scene((button, target, shuttle), motions=(run,)), Goal.of(visit=visit)


def goals(_scene: Scene) -> tuple[Goal, ...]:
    """Return a goal for each of the second to the fifth visit."""
    return tuple(Goal.of(visit=visit) for visit in VISITS)


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: move above the button, wait, press."""
    visit = goal.number("visit")
    interval = scene.motions_of(Shuttle)[0].interval
    stopped = Fact("stopped", "shuttle", "target")
    wrong = _wrong(interval, visit)
    hover = Stage(
        expects=Fact("hovering", "robot", "button"),
        forbids=wrong,
        primitive=Primitive("hover", "button"),
        subgoal="move to the top of the button {at} to prepare",
        points_at="button",
    )
    waits = [
        Stage(
            expects=Elapsed(least=checkpoint),
            forbids=wrong,
            primitive=Primitive("hold_until", "robot", steps=checkpoint),
            subgoal="remain static",
        )
        for checkpoint in checkpoints(interval, visit)
    ]
    too_early = Rule(
        OccurrenceCount((stopped,), least=1, until=interval * (visit - 1) - 1),
        "stopped the cube on an earlier visit",
        "wrong_time",
    )
    press = Stage(
        expects=stopped,
        forbids=(*wrong, too_early),
        primitive=Primitive("press_below", "button", steps=interval * visit - interval // 2),
        subgoal="press the button to stop the cube on the target {at}",
        points_at="target",
    )
    return (hover, *waits, press)


def checkpoints(interval: int, visit: int) -> tuple[int, ...]:
    """Return the control steps since reset at which waiting stages end, the last to press.

    Args:
        interval: control steps of one pass.
        visit: the goal's visit, from 1; its middle is half an interval before its pass ends.
    """
    press = interval * visit - interval // 2 - LEAD
    return (*range(CHECKPOINT, press, CHECKPOINT), press)


def _wrong(interval: int, visit: int) -> tuple[Rule, ...]:
    """Return the rules of every stage."""
    off = All((Fact("pressed", "button"), absent(Fact("near", "shuttle", "target"))))
    return (
        Rule(off, "pressed the button while the cube was off the target", "mistimed"),
        Rule(
            Elapsed(least=interval * visit + 1),
            f"let the cube's {ORDINALS[visit - 1]} visit pass",
        ),
    )


COMMANDS = Commands(
    wordings=command_pools(
        train=(
            "Press the button to stop the cube on the target {visit}.",
            "Use the button to stop the cube on the target {visit}.",
            "Stop the cube on the target {visit} by pressing the button.",
        ),
        test=(
            "Push the button so that the cube stops on the target {visit}.",
            "Halt the cube on the target {visit} by pushing the button.",
            "Push the button to make the cube stop on the target {visit}.",
        ),
    ),
)

TASK = Task(
    name="StopCube",
    suite="counting",
    code=2,
    spatial=False,
    sample=sample,
    goals=goals,
    stages=stages,
    commands=COMMANDS,
    words="StopCube.toml",
)
