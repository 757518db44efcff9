"""PickByCount: pick the yellow or the gray tape and place it on the target, once or twice.

Simulated twin of a real-robot task. Nothing marks the end: like an operator, the judge waits
whether the robot continues. Facts: the paper's study with a real robot. Difficulties do not differ.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from roboirg.core.conditions import Elapsed, Fact, Rule
from roboirg.core.episode import Color, Difficulty, Goal, Primitive, Scene, SceneObject, Stage
from roboirg.core.footprints import Region
from roboirg.tasks.shared.fixtures import (
    DiscPlan,
    ItemPlan,
    counted_goals,
    disc_area,
    draw_item,
    draw_number,
    draw_target,
)
from roboirg.tasks.shared.real_table import draw_regions
from roboirg.tasks.shared.stages import placing_stages
from roboirg.tasks.task import GoalThings, SceneAndGoal, Task
from roboirg.util.random_draws import draw

TAPES: tuple[Color, ...] = ("yellow", "gray")
REPEATS = (1, 2)

TARGET = DiscPlan("target", Region(0.06, 0.0, 0.1, 0.1), radius=0.05)
LEFT_TAPE_REGION = Region(-0.09, 0.14, 0.11, 0.09)
TAPE_GAP = 0.03
WAIT_STEPS = 140
"""Control steps without a pick that end the task: a policy that continues has picked a tape by
then. The longest pick in RoboMME's data takes 137."""


def sample(rng: np.random.Generator, _difficulty: Difficulty) -> SceneAndGoal:
    """Draw the target and a tape on either side; sides, goal tape and number are uniform.

    The order of the draws decides which scene a seed gives.
    """
    target = draw_target(rng, TARGET, ())
    tapes = _draw_tapes(rng, target)
    goal = Goal.of(color=draw(rng, TAPES), repeats=draw_number(rng, REPEATS))
    return Scene((*tapes, target)), goal


def _draw_tapes(rng: np.random.Generator, target: SceneObject) -> list[SceneObject]:
    """Draw a tape of each color, ``tape_yellow`` and ``tape_gray``, one on either side."""
    tapes = []
    for color, region in draw_regions(rng, TAPES, LEFT_TAPE_REGION).items():
        plan = ItemPlan(f"tape_{color}", color, region, TAPE_GAP, "tape")
        tapes.append(draw_item(rng, plan, [disc_area(target)]))
    return tapes


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: N times pick and place, then leave all tapes alone for a while.

    What a stage forbids fails the episode. Picking the other tape is forbidden in all stages, a
    further pick of the right one in the last, which is complete after `WAIT_STEPS` without it.
    """
    color = goal.text("color")
    wrong = []
    for tape in scene.of_kind("tape"):
        if tape.color != color:
            cause = f"picked up the {tape.color} tape"
            wrong.append(Rule(Fact("picked", tape.name), cause, failure="wrong_object"))
    again = Rule(
        Fact("picked", f"tape_{color}"), f"picked up the {color} tape again", failure="wrong_count"
    )
    plan = placing_stages("tape", color, goal.number("repeats"))
    leave = Stage(
        expects=Elapsed(WAIT_STEPS, timer="left alone"),
        forbids=(again,),
        primitive=Primitive("retreat", "robot", steps=WAIT_STEPS),
        subgoal="leave the tapes where they are",
        timer="left alone",
    )
    return tuple(stage.forbidding(*wrong) for stage in (*plan, leave))


TASK = Task(
    name="PickByCount",
    suite="real",
    code=13,
    spatial=True,
    sample=sample,
    goals=partial(counted_goals, kind="tape", most=REPEATS[1]),
    stages=stages,
    things=GoalThings(handled="tape", colored="tape", pointed="tape", colors=TAPES),
    words="real_study.toml",
)
