"""ButtonUnmaskSwap: press both buttons while containers change places, then lift the right ones.

Permanence suite. As VideoUnmaskSwap, but without a video: the containers move during the policy's
first steps, independent of its actions. Facts: RoboMME.
"""

from __future__ import annotations

import numpy as np

from roboirg.core.conditions import All, Fact, FactCount, OccurrenceCount
from roboirg.core.episode import Difficulty, Goal, Scene, Stage
from roboirg.core.footprints import Region
from roboirg.tasks.shared import unmask, unmask_swap
from roboirg.tasks.shared.fixtures import button_keep_out, draw_button
from roboirg.tasks.shared.layouts import PlanePoint
from roboirg.tasks.shared.stages import press_stage
from roboirg.tasks.task import SceneAndGoal, Task
from roboirg.util.random_draws import draw

RIGHT = "button_right"
"""On the robot's right (smaller y)."""
LEFT = "button_left"
RIGHT_REGION = Region(-0.2, -0.1, 0.025, 0.025)
LEFT_REGION = Region(-0.2, 0.1, 0.025, 0.025)

FOUR: tuple[PlanePoint, ...] = ((0.0, -0.1), (0.0, 0.1), (0.1, 0.1), (0.1, -0.1))
TRIANGLE: tuple[PlanePoint, ...] = ((-0.05, -0.15), (-0.05, 0.15), (0.05, 0.0))
LINE: tuple[PlanePoint, ...] = ((-0.05, -0.15), (-0.05, 0.15), (-0.05, 0.0))
MAX_SHIFT = 0.1
"""Largest shift of the points, m: of four, both rows sideways; of three, each away."""


def shifted_points(rng: np.random.Generator, count: int) -> tuple[PlanePoint, ...]:
    """Draw three or four points (x, y; meters) near which the containers stand.

    The pattern is shifted at random, but, unlike VideoUnmaskSwap's, not turned. Four points: each
    of the two rows moves sideways by its own shift. Three, in a triangle or on a line: each point
    moves away from the robot by its own shift. Draws come in the order of the points.
    """
    points = []
    if count == len(FOUR):
        for row in (FOUR[:2], FOUR[2:]):
            shift = MAX_SHIFT * rng.random()
            points += [(x, y + shift) for x, y in row]
        return tuple(points)
    for x, y in draw(rng, (TRIANGLE, LINE)):
        shift = MAX_SHIFT * rng.random()
        points.append((x + shift, y))
    return tuple(points)


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw two buttons, and containers near the points of a layout, three of them over a cube.

    Draws come in this order: right button, left button, points, containers, then cubes, swaps and
    goal.
    """
    right = draw_button(rng, RIGHT_REGION, RIGHT)
    left = draw_button(rng, LEFT_REGION, LEFT)
    points = shifted_points(rng, unmask_swap.CONTAINERS[difficulty])
    # As in RoboMME, the left button keeps no container away; none can touch it.
    containers = unmask_swap.draw_containers_about(rng, points, [button_keep_out(right)])
    return unmask_swap.sample(rng, difficulty, containers, (right, left))


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: press both buttons, in any order, then lift the containers.

    The subgoals and the oracle press the left button first; the judge accepts either.
    """
    left = Fact("pressed", LEFT)
    right = Fact("pressed", RIGHT)
    either = FactCount((left, right))
    both = All((OccurrenceCount((left,)), OccurrenceCount((right,))))
    return (
        press_stage("press the first button {at}", expects=either, button=LEFT),
        press_stage("press the second button {at}", expects=both, button=RIGHT),
        *unmask.pick_stages(scene, goal),
    )


TASK = Task(
    name="ButtonUnmaskSwap",
    suite="permanence",
    code=7,
    spatial=True,
    sample=sample,
    goals=unmask.goals,
    stages=stages,
    things=unmask.HIDDEN_CUBE_THINGS,
    words="containers.toml",
)
