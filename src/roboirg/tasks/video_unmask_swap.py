"""VideoUnmaskSwap: watch containers appear over cubes and change places, lift the right ones.

Permanence suite. Containers that change places also exchange their orientations, so only the
movement in the video shows where a cube has gone. Facts: RoboMME.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from roboirg.core.episode import Difficulty, Scene, Stage
from roboirg.tasks.shared import unmask, unmask_swap
from roboirg.tasks.shared.layouts import layout_points
from roboirg.tasks.shared.stages import hold_still
from roboirg.tasks.shared.swapping import last_step
from roboirg.tasks.task import SceneAndGoal, Task, command_pools


def sample(rng: np.random.Generator, difficulty: Difficulty) -> SceneAndGoal:
    """Draw containers near the points of a turned layout, three of them over a cube."""
    points = layout_points(rng, unmask_swap.CONTAINERS[difficulty])
    return unmask_swap.sample(rng, difficulty, unmask_swap.draw_containers_about(rng, points))


def demonstration(scene: Scene) -> tuple[Stage, ...]:
    """Return the video's stage: hold still until the last swap, for 114, 164 or 214 steps."""
    return (hold_still(last_step(scene.motions)),)


COMMANDS = replace(
    unmask.container_commands(
        command_pools(
            train=(
                "Think back to the video and lift {colors.0}.",
                "Going by the video, lift {colors.0}.",
                "Remember the video and lift {colors.0}.",
                "Lift {colors.0}, set it down, then lift {colors.1}.",
                "Lift {colors.0}, put it down, and then lift {colors.1}.",
                "First lift {colors.0}, put it down, then lift {colors.1}.",
            ),
            test=(
                "Keep the video in mind and raise {colors.0}.",
                "Going by what you saw, raise {colors.0}.",
                "Watch the video and pick up {colors.0}.",
                "Raise {colors.0}, put it back, then raise {colors.1}.",
                "Pick up {colors.0}, put it back, then pick up {colors.1}.",
                "First raise {colors.0}, set it back, then raise {colors.1}.",
            ),
        )
    ),
    by_place="the container that started {place}",
    things_at="the container that started {place}",
)

TASK = Task(
    name="VideoUnmaskSwap",
    suite="permanence",
    code=5,
    spatial=True,
    sample=sample,
    goals=unmask.goals,
    stages=unmask.pick_stages,
    commands=COMMANDS,
    demonstration=demonstration,
    words="containers.toml",
)
