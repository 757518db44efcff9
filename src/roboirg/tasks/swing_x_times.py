"""SwingXtimes: carry a cube over the right and left target N times, put it down, press the button.

Counting suite. A disc lights up while the cube is over it and a little longer; nothing shows the
count. Facts: RoboMME.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from roboirg.core.conditions import Fact, OccurrenceCount, Rule
from roboirg.core.episode import Difficulty, Goal, Primitive, Scene, SceneObject, Stage
from roboirg.core.footprints import Region
from roboirg.core.motions import Glow
from roboirg.tasks.shared.fixtures import (
    ORDINALS,
    Bounds,
    DiscPlan,
    counted_goals,
    draw_button_and_cubes,
    draw_number,
    draw_targets,
    marker_over,
)
from roboirg.tasks.shared.stages import (
    PRESSED,
    facts_of_others,
    pick_stage,
    press_stage,
    put_down_stage,
)
from roboirg.tasks.task import SceneAndGoal, Task
from roboirg.util.random_draws import draw

REPEATS: dict[Difficulty, Bounds] = {"easy": (1, 3), "medium": (1, 2), "hard": (3, 3)}
MAX_REPEATS = 3

CUBE_REGION = Region(-0.1, 0.0, 0.25, 0.25)
CUBE_GAP = 0.02
SIDES = ("right", "left")
"""Of the two targets, as the robot sees them, in the order of visits."""
RIGHT_TARGET = DiscPlan(
    "target_right",
    Region(-0.1, -0.2, 0.1, 0.1),
    radius=0.04,
    gap=0.02,
    rgb=(128 / 255, 128 / 255, 128 / 255),
)
TARGETS = (
    RIGHT_TARGET,
    RIGHT_TARGET._replace(name="target_left", region=Region(-0.1, 0.2, 0.1, 0.1)),
)
"""In the order of `SIDES`."""
LINGER = 20
"""Control steps for which a target stays lit after the cube has left it."""


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw button, cubes and a target on either side; goal cube and repeats are uniform.

    The order of the draws decides which scene a seed gives.
    """
    repeats = draw_number(rng, REPEATS[difficulty])
    placed = draw_button_and_cubes(rng, difficulty, CUBE_REGION, CUBE_GAP)
    targets = draw_targets(rng, TARGETS, placed.obstacles)
    chosen = draw(rng, placed.cubes)
    scene = make_scene(placed.button, placed.cubes, targets, chosen.name)
    goal = Goal.of(color=str(chosen.color), repeats=repeats)
    return scene, goal


def make_scene(
    button: SceneObject, cubes: Sequence[SceneObject], targets: Sequence[SceneObject], cube: str
) -> Scene:
    """Return the scene in which each target lights up while the cube of the goal is over it.

    A target lights up as a marker, a disc over it, appears. `cube` is the name of the goal's.
    """
    markers = []
    motions = []
    for target in targets:
        marker = marker_over(target)
        is_over = Fact("over", cube, target.name)
        markers.append(marker)
        motions.append(Glow(marker.name, is_over, LINGER))
    return Scene(
        objects=(button, *cubes, *targets, *markers),
        motions=tuple(motions),
    )


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return 2 N + 3 stages: pick, N times over the right and left target, put down, press.

    For one time: pick, right, left, put down, press. What a stage forbids fails the episode: in
    every stage picking another cube and more visits than the goal's; in all but the last, a press.
    """
    color = goal.text("color")
    repeats = goal.number("repeats")
    cube = f"cube_{color}"
    wrong_picks = facts_of_others("picked", scene.of_kind("cube"), cube)
    too_often = _too_often(cube, len(SIDES) * repeats)
    plan = []
    for stage in _carrying(color, repeats):
        plan.append(stage.forbidding(*wrong_picks, PRESSED, too_often))
    plan.append(press_stage().forbidding(*wrong_picks, too_often))
    return tuple(plan)


def _carrying(color: str, repeats: int) -> Iterator[Stage]:
    """Yield the stages before the press: pick, the swings over both targets, put down.

    They forbid nothing yet.
    """
    cube = f"cube_{color}"
    yield pick_stage(cube, f"pick up the {color} cube {{at}}")
    for ordinal in ORDINALS[:repeats]:
        for side in SIDES:
            yield _swing(cube, side, ordinal)
    yield put_down_stage(Primitive("put_down", cube), f"put the {color} cube on the table")


def _too_often(cube: str, visits: int) -> Rule:
    """Return the rule against more visits of the targets than `visits`, of both together.

    Visits in a wrong order complete no stage but count, so they also violate this rule.
    """
    over = tuple(Fact("over", cube, f"target_{side}") for side in SIDES)
    limit = OccurrenceCount(over, least=visits + 1)
    return Rule(limit, "moved the cube over a target too often")


def _swing(cube: str, side: str, ordinal: str) -> Stage:
    """Return the stage in which the cube is carried over the target on a side."""
    target = f"target_{side}"
    return Stage(
        expects=Fact("over", cube, target),
        primitive=Primitive("move_over", cube, target),
        subgoal=f"move to the top of the {side}-side target {{at}} for the {ordinal} time",
        points_at=target,
    )


TASK = Task(
    name="SwingXtimes",
    suite="counting",
    code=3,
    spatial=True,
    sample=sample,
    goals=partial(counted_goals, kind="cube", most=MAX_REPEATS),
    stages=stages,
    words="color_and_number.toml",
)
