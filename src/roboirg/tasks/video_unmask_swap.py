"""VideoUnmaskSwap: watch containers appear over cubes and change places, lift the right ones.

Permanence suite. Containers that change places also exchange their orientations, so only the
movement in the video shows where a cube has gone. Facts: RoboMME.
"""

from __future__ import annotations

import numpy as np

from roboirg.core.episode import Difficulty, Scene, Stage
from roboirg.tasks.shared import unmask, unmask_swap
from roboirg.tasks.shared.layouts import layout_points
from roboirg.tasks.shared.stages import hold_still
from roboirg.tasks.shared.swapping import last_step
from roboirg.tasks.task import SceneAndGoal, Task


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw containers near the points of a turned layout, three of them over a cube."""
    points = layout_points(rng, unmask_swap.CONTAINERS[difficulty])
    return unmask_swap.sample(rng, difficulty, unmask_swap.draw_containers_about(rng, points))


def demonstration(scene: Scene) -> tuple[Stage, ...]:
    """Return the video's stage: hold still until the last swap is complete.

    With one, two or three swaps these are 114, 164 or 214 control steps.
    """
    return (hold_still(last_step(scene.motions)),)


TASK = Task(
    name="VideoUnmaskSwap",
    suite="permanence",
    code=5,
    spatial=True,
    sample=sample,
    goals=unmask.goals,
    stages=unmask.pick_stages,
    things=unmask.CONTAINER_THINGS,
    demonstration=demonstration,
    words="containers.toml",
)
