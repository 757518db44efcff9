"""VideoUnmask: watch in the video which container covers which cube, then lift the right ones.

Permanence suite. The video shows the open cubes, then identical containers over them; the policy
sees only containers. In hard episodes one container is put down and a second is lifted.
Facts: RoboMME.
"""

from __future__ import annotations

from roboirg.core.episode import Scene, Stage
from roboirg.tasks.shared import unmask
from roboirg.tasks.shared.stages import hold_still
from roboirg.tasks.task import Task, command_pools

HOLD_STEPS = 64


def demonstration(_scene: Scene) -> tuple[Stage, ...]:
    """Return the video's stage: hold still for 64 steps."""
    return (hold_still(HOLD_STEPS),)


COMMANDS = unmask.container_commands(
    command_pools(
        train=(
            "Think back to the video and lift {colors.0}.",
            "Going by the video, lift {colors.0}.",
            "Remember the video and lift {colors.0}.",
            "First lift {colors.0}, put it down, then lift {colors.1}.",
            "Lift {colors.0}, put it down, then lift {colors.1}.",
            "Lift {colors.0}, set it down, and lift {colors.1}.",
        ),
        test=(
            "Keep the video in mind and raise {colors.0}.",
            "Going by what you saw, raise {colors.0}.",
            "Pick up {colors.0}.",
            "First raise {colors.0}, put it back, then raise {colors.1}.",
            "Pick up {colors.0}, put it back, and pick up {colors.1}.",
            "Raise {colors.0}, set it back, and raise {colors.1}.",
        ),
    )
)

TASK = Task(
    name="VideoUnmask",
    suite="permanence",
    code=6,
    spatial=True,
    sample=unmask.sample,
    goals=unmask.goals,
    stages=unmask.pick_stages,
    commands=COMMANDS,
    demonstration=demonstration,
    words="containers.toml",
)
