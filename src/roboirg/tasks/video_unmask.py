"""VideoUnmask: watch in the video which container covers which cube, then lift the right ones.

Permanence suite. The video shows the open cubes, then identical containers over them; the policy
sees only containers. In hard episodes one container is put down and a second is lifted.
Facts: RoboMME.
"""

from __future__ import annotations

from roboirg.core.episode import Scene, Stage
from roboirg.tasks.shared import unmask
from roboirg.tasks.shared.stages import hold_still
from roboirg.tasks.task import Task

HOLD_STEPS = 64


def demonstration(_scene: Scene) -> tuple[Stage, ...]:
    """Return the video's stage: hold still for 64 steps."""
    return (hold_still(HOLD_STEPS),)


TASK = Task(
    name="VideoUnmask",
    suite="permanence",
    code=6,
    spatial=True,
    sample=unmask.sample,
    goals=unmask.goals,
    stages=unmask.pick_stages,
    things=unmask.CONTAINER_THINGS,
    demonstration=demonstration,
    words="containers.toml",
)
