"""SwingXtimes: carry a cube over the right and left target N times, put it down, press the button.

Counting suite. A disc lights up while the cube is over it and a little longer; nothing shows the
count. Facts: RoboMME.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from roboirg.core.conditions import Fact, OccurrenceCount, Rule
from roboirg.core.episode import Difficulty, Goal, Primitive, Scene, SceneObject, Stage
from roboirg.core.footprints import Circle, Region
from roboirg.core.motions import Glow
from roboirg.tasks.shared.fixtures import (
    ORDINALS,
    Bounds,
    counted_goals,
    draw_button_and_cubes,
    draw_number,
    draw_target,
    marker_over,
)
from roboirg.tasks.shared.stages import PRESSED, pick_stage, press_stage
from roboirg.tasks.task import Commands, SceneAndGoal, Task, command_pools
from roboirg.util.random_draws import draw

CUBES: dict[Difficulty, int] = {"easy": 1, "medium": 3, "hard": 3}
REPEATS: dict[Difficulty, Bounds] = {"easy": (1, 3), "medium": (1, 2), "hard": (3, 3)}
MAX_REPEATS = 3

BUTTON_REGION = Region(-0.2, 0.0, 0.05, 0.2)
CUBE_REGION = Region(-0.1, 0.0, 0.25, 0.25)
CUBE_GAP = 0.02
SIDES: dict[str, Region] = {
    "right": Region(-0.1, -0.2, 0.1, 0.1),
    "left": Region(-0.1, 0.2, 0.1, 0.1),
}
"""Regions of the two targets, in the order of visits; sides are the robot's."""
TARGET_RADIUS = 0.04
TARGET_GAP = 0.02
TARGET_RGB = (128 / 255, 128 / 255, 128 / 255)
LINGER = 20
"""Control steps for which a target stays lit after the cube has left it."""


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw button, cubes and a target on either side; goal cube and repeats are uniform."""
    repeats = draw_number(rng, REPEATS[difficulty])
    button, cubes, obstacles = draw_button_and_cubes(
        rng, BUTTON_REGION, CUBES[difficulty], CUBE_REGION, CUBE_GAP
    )
    targets: list[SceneObject] = []
    for side, region in SIDES.items():
        name = f"target_{side}"
        target = draw_target(rng, name, TARGET_RADIUS, region, TARGET_GAP, obstacles, TARGET_RGB)
        targets.append(target)
        obstacles.append(Circle(target.position.x, target.position.y, TARGET_RADIUS))
    chosen = draw(rng, cubes)
    goal = Goal.of(color=str(chosen.color), repeats=repeats)
    return make_scene(button, cubes, targets, chosen.name), goal


def make_scene(
    button: SceneObject, cubes: Sequence[SceneObject], targets: Sequence[SceneObject], cube: str
) -> Scene:
    """Return the scene in which each target lights up while the cube of the goal is over it.

    `targets` are in the order of `SIDES`.
    """
    markers = [
        marker_over(target, f"marker_{side}") for side, target in zip(SIDES, targets, strict=True)
    ]
    motions = tuple(
        Glow(marker.name, Fact("over", cube, target.name), LINGER)
        for marker, target in zip(markers, targets, strict=True)
    )
    return Scene((button, *cubes, *targets, *markers), motions)


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return 2 N + 3 stages: pick, N times over the right and left target, put down, press."""
    color, repeats = goal.text("color"), goal.number("repeats")
    cube = f"cube_{color}"
    visits = tuple(Fact("over", cube, f"target_{side}") for side in SIDES)
    # Visits in a wrong order complete no stage but count, so they also violate this rule.
    too_often = Rule(
        OccurrenceCount(visits, least=2 * repeats + 1), "moved the cube over a target too often"
    )
    wrong_cubes = [Fact("picked", item.name) for item in scene.of_kind("cube") if item.name != cube]
    wrong: tuple[Fact | Rule, ...] = (*wrong_cubes, PRESSED, too_often)
    pick = pick_stage(cube, f"pick up the {color} cube {{at}}", wrong)
    swings = [
        _swing(cube, side, ordinal, wrong) for ordinal in ORDINALS[:repeats] for side in SIDES
    ]
    put_down = Stage(
        expects=Fact("lying", cube),
        forbids=wrong,
        primitive=Primitive("put_down", cube),
        subgoal=f"put the {color} cube on the table",
    )
    return (pick, *swings, put_down, press_stage(forbids=(*wrong_cubes, too_often)))


def _swing(cube: str, side: str, ordinal: str, wrong: tuple[Fact | Rule, ...]) -> Stage:
    target = f"target_{side}"
    return Stage(
        expects=Fact("over", cube, target),
        forbids=wrong,
        primitive=Primitive("move_over", cube, target),
        subgoal=f"move to the top of the {side}-side target {{at}} for the {ordinal} time",
        points_at=target,
    )


COMMANDS = Commands(
    wordings=command_pools(
        train=(
            (
                "Swing {color} from your right to your left target {repeats}, put it "
                "down and press the button."
            ),
            (
                "Move {color} from your right to your left target {repeats}, put "
                "it down and press the button."
            ),
            (
                "Bring {color} from your right to your left target {repeats}, "
                "set it down and press the button."
            ),
        ),
        test=(
            (
                "Carry {color} from your right to your left target "
                "{repeats}, set it down and push the button."
            ),
            (
                "Grab {color}, swing it from your right to your left target {repeats}, "
                "put it down and press the button."
            ),
            (
                "Swing {color} from your right to your left target {repeats}, "
                "put it down and push the button."
            ),
        ),
    ),
)

TASK = Task(
    name="SwingXtimes",
    suite="counting",
    code=3,
    spatial=True,
    sample=sample,
    goals=partial(counted_goals, kind="cube", most=MAX_REPEATS),
    stages=stages,
    commands=COMMANDS,
    words="color_and_number.toml",
)
