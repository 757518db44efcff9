"""PickXtimes: pick a cube and place it on the target N times, then press the button.

Counting suite. All objects are visible from the start. After the first placement all states look
alike, so the policy must count its placements to know when to press. Facts: RoboMME.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from roboirg.core.episode import Difficulty, Goal, Scene, Stage
from roboirg.core.footprints import Region
from roboirg.tasks.shared.fixtures import (
    Bounds,
    DiscPlan,
    counted_goals,
    draw_button_and_cubes,
    draw_number,
    draw_target,
)
from roboirg.tasks.shared.stages import (
    PRESSED,
    facts_of_all,
    facts_of_others,
    placing_stages,
    press_stage,
)
from roboirg.tasks.task import SceneAndGoal, Task
from roboirg.util.random_draws import draw

REPEATS: dict[Difficulty, Bounds] = {"easy": (1, 3), "medium": (1, 3), "hard": (4, 5)}
MAX_REPEATS = 5

WORK_REGION = Region(-0.1, 0.0, 0.2, 0.2)
CUBE_GAP = 0.02
TARGET = DiscPlan("target", WORK_REGION, radius=0.04, gap=0.04)


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw button, cubes of different colors, target disc; goal cube and repeats are uniform.

    The order of the draws decides which scene a seed gives. Raises SceneRejectedError without room.
    """
    repeats = draw_number(rng, REPEATS[difficulty])
    placed = draw_button_and_cubes(rng, difficulty, WORK_REGION, CUBE_GAP)
    target = draw_target(rng, TARGET, placed.obstacles)
    chosen = draw(rng, placed.cubes)
    scene = Scene((placed.button, *placed.cubes, target))
    goal = Goal.of(color=str(chosen.color), repeats=repeats)
    return scene, goal


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return 2 N + 1 stages: N times pick the goal's cube and place it, then press the button.

    What a stage forbids fails the episode: until the press, picking another cube and pressing
    early; in the last stage, any pick.
    """
    color = goal.text("color")
    cubes = scene.of_kind("cube")
    wrong_picks = facts_of_others("picked", cubes, f"cube_{color}")
    plan = []
    for stage in placing_stages("cube", color, goal.number("repeats")):
        plan.append(stage.forbidding(*wrong_picks, PRESSED))
    press = press_stage("press the button {at} to stop")
    plan.append(press.forbidding(*facts_of_all("picked", cubes)))
    return tuple(plan)


TASK = Task(
    name="PickXtimes",
    suite="counting",
    code=1,
    spatial=True,
    sample=sample,
    goals=partial(counted_goals, kind="cube", most=MAX_REPEATS),
    stages=stages,
    words="color_and_number.toml",
)
