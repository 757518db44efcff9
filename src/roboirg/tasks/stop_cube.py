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
from roboirg.tasks.shared.fixtures import BUTTON_REGION, ORDINALS, draw_button
from roboirg.tasks.shared.stages import PRESSED
from roboirg.tasks.task import SceneAndGoal, Task
from roboirg.util.random_draws import draw

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
STOPPED = Fact("stopped", "shuttle", "target")


def sample(rng: np.random.Generator, _difficulty: Difficulty) -> SceneAndGoal:
    """Draw button, target and cube; speed, goal visit and direction of the path are uniform.

    The cube has a random color, which means nothing. The order of the draws decides which scene a
    seed gives: the cube's color and speed before the goal's visit.
    """
    button = draw_button(rng, BUTTON_REGION)
    target = _draw_target(rng)
    red, green, blue = rng.random(3).tolist()
    interval = draw(rng, INTERVALS)
    visit = draw(rng, VISITS)
    run = _draw_run(rng, target.position, interval)
    shuttle = SceneObject("shuttle", "shuttle", run.begin, rgb=(red, green, blue))
    scene = Scene(
        objects=(button, target, shuttle),
        motions=(run,),
    )
    return scene, Goal.of(visit=visit)


def _draw_target(rng: np.random.Generator) -> SceneObject:
    """Draw the target, which is as high as the middle of the cube that moves over it."""
    middle = Point(*TARGET_REGION.draw(rng), HEIGHT)
    return SceneObject(
        "target",
        "target",
        middle,
        radius=TARGET_RADIUS,
        thickness=TARGET_THICKNESS,
    )


def _draw_run(rng: np.random.Generator, middle: Point, interval: int) -> Shuttle:
    """Draw the direction of the cube's path, given its middle and the steps of one pass.

    A path along the y axis, from the robot's right (smaller y) to its left, turned by at most
    `PATH_ANGLE` to either side; its ends are `PATH_HALF` meters from the middle.
    """
    # Uniform, to either side of the y axis.
    angle = (2.0 * rng.random() - 1.0) * PATH_ANGLE
    along_x = -PATH_HALF * math.sin(angle)
    along_y = PATH_HALF * math.cos(angle)
    begin = Point(middle.x - along_x, middle.y - along_y, HEIGHT)
    end = Point(middle.x + along_x, middle.y + along_y, HEIGHT)
    return Shuttle(
        "shuttle",
        begin,
        end,
        interval=interval,
        passes=PASSES,
        stopped_by=PRESSED,
    )


def goals(_scene: Scene) -> tuple[Goal, ...]:
    """Return a goal for each of the second to the fifth visit."""
    return tuple(Goal.of(visit=visit) for visit in VISITS)


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: move above the button, wait, press.

    The waiting is several stages, since as in RoboMME each ends at a checkpoint. What a stage
    forbids fails the episode: in all stages a press off the target and letting the goal's visit
    pass, in the last also stopping the cube on an earlier visit.
    """
    visit = goal.number("visit")
    interval = scene.motions_of(Shuttle)[0].interval
    wrong = _wrong(interval, visit)
    hover = Stage(
        expects=Fact("hovering", "robot", "button"),
        forbids=wrong,
        primitive=Primitive("hover", "button"),
        subgoal="move to the top of the button {at} to prepare",
        points_at="button",
    )
    waits = [_wait(checkpoint, wrong) for checkpoint in checkpoints(interval, visit)]
    press = Stage(
        expects=STOPPED,
        forbids=(*wrong, _too_early(interval, visit)),
        primitive=Primitive("press_below", "button", steps=_middle_of(interval, visit)),
        subgoal="press the button to stop the cube on the target {at}",
        points_at="target",
    )
    return (hover, *waits, press)


def _middle_of(interval: int, visit: int) -> int:
    """Return the control steps since reset to the middle of a visit, counted from 1.

    With passes of 60 steps, the second takes steps 60 to 120, its middle is 90.
    """
    return interval * visit - interval // 2


def _wait(checkpoint: int, wrong: tuple[Rule, ...]) -> Stage:
    """Return the stage in which the hand waits until `checkpoint` control steps since reset.

    What holds in `wrong` meanwhile fails the episode.
    """
    return Stage(
        expects=Elapsed(least=checkpoint),
        forbids=wrong,
        primitive=Primitive("hold_until", "robot", steps=checkpoint),
        subgoal="remain static",
    )


def checkpoints(interval: int, visit: int) -> tuple[int, ...]:
    """Return the control steps since reset at which waiting stages end, the last to press.

    Passes of 80 steps, third visit -> 100 and 170: `LEAD` steps before the cube is on the target.

    Args:
        interval: control steps of one pass.
        visit: the goal's visit, from 1.
    """
    press = _middle_of(interval, visit) - LEAD
    return (*range(CHECKPOINT, press, CHECKPOINT), press)


def _wrong(interval: int, visit: int) -> tuple[Rule, ...]:
    """Return the rules of every stage: no press off the target, and none after the goal's visit.

    `interval` is the control steps of one pass over the target; visits are counted from 1.
    """
    is_off_target = absent(Fact("near", "shuttle", "target"))
    press_off_target = All((PRESSED, is_off_target))
    too_late = Elapsed(least=interval * visit + 1)
    return (
        Rule(press_off_target, "pressed the button while the cube was off the target", "mistimed"),
        Rule(too_late, f"let the cube's {ORDINALS[visit - 1]} visit pass"),
    )


def _too_early(interval: int, visit: int) -> Rule:
    """Return the rule against stopping the cube before the pass of a visit begins.

    Passes of 60 steps, third visit -> no stop in steps 0 to 119.
    """
    last_step = interval * (visit - 1) - 1
    stop = OccurrenceCount((STOPPED,), least=1, until=last_step)
    return Rule(stop, "stopped the cube on an earlier visit", "wrong_time")


TASK = Task(
    name="StopCube",
    suite="counting",
    code=2,
    spatial=False,
    sample=sample,
    goals=goals,
    stages=stages,
    words="StopCube.toml",
)
