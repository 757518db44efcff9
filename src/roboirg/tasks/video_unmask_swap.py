"""VideoUnmaskSwap: watch containers appear over cubes and change places, lift the right ones.

Permanence suite. Containers that change places also exchange their orientations, so only the
movement in the video shows where a cube has gone. Facts: RoboMME.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from roboirg.core.episode import Difficulty, Goal, Scene, Stage
from roboirg.tasks.shared import unmask, unmask_swap, video_stages
from roboirg.tasks.shared.layouts import layout_points
from roboirg.tasks.shared.swapping import last_step
from roboirg.tasks.task import Task, Wording


def sample(rng: np.random.Generator, difficulty: Difficulty) -> tuple[Scene, Goal]:
    """Draw containers near the points of a turned layout, three of them over a cube."""
    points = layout_points(rng, unmask_swap.CONTAINERS[difficulty])
    return unmask_swap.sample(rng, difficulty, unmask_swap.draw_containers_about(rng, points))


def demonstration(scene: Scene) -> tuple[Stage, ...]:
    """Return the video's stage: hold still until the last swap, for 114, 164 or 214 steps."""
    return (video_stages.hold_still(last_step(scene.motions)),)


COMMANDS = replace(
    unmask.commands(
        Wording("Going by everything that happened in the video, lift {colors.0}."),
        Wording(
            "Keep in mind what the video showed from beginning to end, and pick up {colors.0}."
        ),
        Wording("Remember all that you saw in the video, then lift {colors.0}."),
        Wording(
            "Going by everything that happened in the video, lift {colors.0}, put it back down, "
            "and then lift {colors.1}.",
            parts=2,
        ),
        Wording(
            "Keep in mind what the video showed from beginning to end, and pick up {colors.0}, "
            "set it down again, and after that pick up {colors.1}.",
            parts=2,
        ),
        Wording(
            "Remember all that you saw in the video, then lift {colors.0}, put it down, "
            "and finally lift {colors.1}.",
            parts=2,
        ),
    ),
    by_place="the container that was {place} before anything moved",
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
)
