"""ButtonUnmask: watch containers appear over cubes, press the button, lift the right containers.

Permanence suite. As VideoUnmask, but without a video: the cubes lie open during the policy's first
steps, independent of its actions. In hard episodes one container is put down and a second lifted.
Facts: RoboMME.
"""

from __future__ import annotations

import numpy as np

from roboirg.core.episode import Difficulty, Goal, Scene, Stage
from roboirg.core.footprints import Region
from roboirg.tasks.shared import unmask
from roboirg.tasks.shared.fixtures import draw_button
from roboirg.tasks.shared.stages import press_stage
from roboirg.tasks.task import SceneAndGoal, Task

BUTTON_REGION = Region(-0.2, 0.0, 0.05, 0.05)


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw a button, then containers as in VideoUnmask; the goal is one, in hard episodes two."""
    return unmask.sample(rng, difficulty, [draw_button(rng, BUTTON_REGION)])


def stages(scene: Scene, goal: Goal) -> tuple[Stage, ...]:
    """Return the stages: press the button, then lift the goal's containers in its order."""
    return (press_stage(), *unmask.pick_stages(scene, goal))


TASK = Task(
    name="ButtonUnmask",
    suite="permanence",
    code=8,
    spatial=True,
    sample=sample,
    goals=unmask.goals,
    stages=stages,
    things=unmask.HIDDEN_CUBE_THINGS,
    words="containers.toml",
)
