"""ButtonUnmask: watch containers appear over cubes, press the button, lift the right containers.

Permanence suite. As VideoUnmask, but without a video: the cubes lie open during the policy's first
steps, independent of its actions. In hard episodes one container is put down and a second lifted.
Facts: RoboMME.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from roboirg.core.episode import Difficulty, Goal, Scene, Stage
from roboirg.core.footprints import Region
from roboirg.tasks.shared import unmask
from roboirg.tasks.shared.fixtures import draw_button
from roboirg.tasks.shared.stages import press_stage
from roboirg.tasks.task import SceneAndGoal, Task, command_pools

BUTTON_REGION = Region(-0.2, 0.0, 0.05, 0.05)


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw a button, then containers as in VideoUnmask; the first ones are to be lifted."""
    return unmask.sample(rng, difficulty, [draw_button(rng, BUTTON_REGION)])


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: press the button, then lift the containers."""
    return (press_stage(), *unmask.pick_stages(scene, goal))


COMMANDS = replace(
    unmask.container_commands(
        command_pools(
            train=(
                "Press the button, then lift {colors.0}.",
                "Press the button and lift {colors.0}.",
                "First press the button, then lift {colors.0}.",
                "Press the button, lift {colors.0}, put it down, then lift {colors.1}.",
                "Press the button, lift {colors.0}, set it down, and lift {colors.1}.",
                "Press the button, lift {colors.0}, put it back, then lift {colors.1}.",
            ),
            test=(
                "Push the button, then raise {colors.0}.",
                "Push the button and pick up {colors.0}.",
                "Start by pushing the button, then raise {colors.0}.",
                "Push the button, raise {colors.0}, put it back, then raise {colors.1}.",
                "Push the button, pick up {colors.0}, put it back and pick up {colors.1}.",
                "Push the button, raise {colors.0}, set it back, and raise {colors.1}.",
            ),
        )
    ),
    # Only the cubes are there when the words are said.
    by_place="the container over the cube {place}",
    pointed="hidden_cube",
    things_at="the cube {place}",
)

TASK = Task(
    name="ButtonUnmask",
    suite="permanence",
    code=8,
    spatial=True,
    sample=sample,
    goals=unmask.goals,
    stages=stages,
    commands=COMMANDS,
    words="containers.toml",
)
