"""PickXtimes: pick a cube and place it on the target N times, then press the button.

Counting suite. All objects are visible from the start. After the first placement all states look
alike, so the policy must count its placements to know when to press. Facts: RoboMME.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from roboirg.core.conditions import Fact
from roboirg.core.episode import Difficulty, Goal, Scene, Stage
from roboirg.core.footprints import Region
from roboirg.tasks.shared.fixtures import (
    Bounds,
    counted_goals,
    draw_button_and_cubes,
    draw_number,
    draw_target,
)
from roboirg.tasks.shared.stages import PRESSED, placing_stages, press_stage
from roboirg.tasks.task import Commands, SceneAndGoal, Task, command_pools
from roboirg.util.random_draws import draw

CUBES: dict[Difficulty, int] = {"easy": 1, "medium": 3, "hard": 3}
REPEATS: dict[Difficulty, Bounds] = {"easy": (1, 3), "medium": (1, 3), "hard": (4, 5)}
MAX_REPEATS = 5

BUTTON_REGION = Region(-0.2, 0.0, 0.05, 0.2)
WORK_REGION = Region(-0.1, 0.0, 0.2, 0.2)
CUBE_GAP = 0.02
TARGET_RADIUS = 0.04
TARGET_GAP = 0.04


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw button, cubes of different colors, target disc; goal cube and repeats are uniform."""
    repeats = draw_number(rng, REPEATS[difficulty])
    button, cubes, obstacles = draw_button_and_cubes(
        rng, BUTTON_REGION, CUBES[difficulty], WORK_REGION, CUBE_GAP
    )
    target = draw_target(rng, "target", TARGET_RADIUS, WORK_REGION, TARGET_GAP, obstacles)
    chosen = draw(rng, cubes)
    goal = Goal.of(color=str(chosen.color), repeats=repeats)
    return Scene((button, *cubes, target)), goal


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return 2 N + 1 stages: N times pick and place, then press."""
    color = goal.text("color")
    cube = f"cube_{color}"
    cubes = tuple(item.name for item in scene.of_kind("cube"))
    wrong_cubes = (Fact("picked", other) for other in cubes if other != cube)
    wrong = (*wrong_cubes, PRESSED)
    plan = placing_stages("cube", color, goal.number("repeats"), wrong)
    picks = tuple(Fact("picked", any_cube) for any_cube in cubes)
    return (*plan, press_stage("press the button {at} to stop", picks))


COMMANDS = Commands(
    wordings=command_pools(
        train=(
            "Put {color} on the target {repeats}, then press the button.",
            "Take {color} and place it on the target {repeats}, then press the button.",
            "Place {color} on the target {repeats} and press the button.",
        ),
        test=(
            "Set {color} on the target {repeats}, then push the button.",
            "Grab {color}, set it down on the target {repeats}, then press the button.",
            "Lay {color} on the target {repeats} and push the button.",
        ),
    ),
)

TASK = Task(
    name="PickXtimes",
    suite="counting",
    code=1,
    spatial=True,
    sample=sample,
    goals=partial(counted_goals, kind="cube", most=MAX_REPEATS),
    stages=stages,
    commands=COMMANDS,
    words="color_and_number.toml",
)
