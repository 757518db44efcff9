"""ButtonUnmaskSwap: press both buttons while containers change places, then lift the right ones.

Permanence suite. As VideoUnmaskSwap, but without a video: the containers move during the policy's
first steps, independent of its actions. Facts: RoboMME.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from roboirg.core.conditions import All, Fact, FactCount, OccurrenceCount
from roboirg.core.episode import Difficulty, Goal, Scene, Stage
from roboirg.core.footprints import Region
from roboirg.tasks.shared import unmask, unmask_swap
from roboirg.tasks.shared.fixtures import button_keep_out, draw_button
from roboirg.tasks.shared.layouts import PlanePoint
from roboirg.tasks.shared.stages import press_stage
from roboirg.tasks.task import SceneAndGoal, Task, command_pools

RIGHT, LEFT = "button_right", "button_left"
"""On the robot's right (smaller y) and left."""
RIGHT_REGION = Region(-0.2, -0.1, 0.025, 0.025)
LEFT_REGION = Region(-0.2, 0.1, 0.025, 0.025)

FOUR: tuple[PlanePoint, ...] = ((0.0, -0.1), (0.0, 0.1), (0.1, 0.1), (0.1, -0.1))
TRIANGLE: tuple[PlanePoint, ...] = ((-0.05, -0.15), (-0.05, 0.15), (0.05, 0.0))
LINE: tuple[PlanePoint, ...] = ((-0.05, -0.15), (-0.05, 0.15), (-0.05, 0.0))
MAX_SHIFT = 0.1
"""Largest shift of the points, m: of four, both rows sideways; of three, each away."""


def shifted_points(rng: np.random.Generator, count: int) -> tuple[PlanePoint, ...]:
    """Draw three or four points near which the containers stand; the pattern is not turned."""
    if count == len(FOUR):
        near, far = (MAX_SHIFT * rng.random(2)).tolist()
        shifts = (near, near, far, far)
        return tuple((x, y + shift) for (x, y), shift in zip(FOUR, shifts, strict=True))
    pattern = (TRIANGLE, LINE)[int(rng.integers(2))]
    return tuple((x + MAX_SHIFT * rng.random(), y) for x, y in pattern)


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw two buttons, and containers near the points of a layout, three of them over a cube."""
    right = draw_button(rng, RIGHT_REGION, RIGHT)
    left = draw_button(rng, LEFT_REGION, LEFT)
    points = shifted_points(rng, unmask_swap.CONTAINERS[difficulty])
    # As in RoboMME, the left button keeps no container away; none can touch it.
    containers = unmask_swap.draw_containers_about(rng, points, [button_keep_out(right)])
    return unmask_swap.sample(rng, difficulty, containers, (right, left))


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: press both buttons, in any order, then lift the containers."""
    right, left = Fact("pressed", RIGHT), Fact("pressed", LEFT)
    both = All((OccurrenceCount((left,)), OccurrenceCount((right,))))
    return (
        press_stage("press the first button {at}", expects=FactCount((left, right)), button=LEFT),
        press_stage("press the second button {at}", expects=both, button=RIGHT),
        *unmask.pick_stages(scene, goal),
    )


COMMANDS = replace(
    unmask.container_commands(
        command_pools(
            train=(
                "Press both buttons, then lift {colors.0}.",
                "Press both buttons and lift {colors.0}.",
                "First press both buttons, then lift {colors.0}.",
                "Press both buttons, lift {colors.0}, put it down, then lift {colors.1}.",
                "Press both buttons, lift {colors.0}, set it down, and lift {colors.1}.",
                "Press both buttons, lift {colors.0}, put it back and lift {colors.1}.",
            ),
            test=(
                "Push both buttons, then raise {colors.0}.",
                "Push both buttons and pick up {colors.0}.",
                "Start by pushing both buttons, then raise {colors.0}.",
                "Push both buttons, raise {colors.0}, put it back, then raise {colors.1}.",
                "Push both buttons, raise {colors.0}, put it back and raise {colors.1}.",
                "Push both buttons, raise {colors.0}, set it back, and raise {colors.1}.",
            ),
        )
    ),
    by_place="the container over the cube {place} now",
    # Only the cubes are there when the words are said.
    pointed="hidden_cube",
    things_at="the cube {place} now",
)

TASK = Task(
    name="ButtonUnmaskSwap",
    suite="permanence",
    code=7,
    spatial=True,
    sample=sample,
    goals=unmask.goals,
    stages=stages,
    commands=COMMANDS,
    words="containers.toml",
)
