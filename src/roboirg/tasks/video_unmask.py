"""VideoUnmask: watch in the video which container covers which cube, then lift the right ones.

Permanence suite. The video shows the open cubes, then identical containers over them; the policy
sees only containers. In hard episodes one container is put down and a second is lifted.
Facts: RoboMME.
"""

from __future__ import annotations

from roboirg.core.episode import Scene, Stage
from roboirg.core.word_pools import Pools
from roboirg.tasks.shared import unmask
from roboirg.tasks.shared.stages import hold_still
from roboirg.tasks.task import Task, Wording

HOLD_STEPS = 64


def demonstration(_scene: Scene) -> tuple[Stage, ...]:
    """Return the video's stage: hold still for 64 steps."""
    return (hold_still(HOLD_STEPS),)


COMMANDS = unmask.container_commands(
    Pools(
        train=(
            Wording("Think back to the video and lift {colors.0}."),
            Wording("Going by the video, lift {colors.0}."),
            Wording("Remember the video and lift {colors.0}."),
            Wording("First lift {colors.0}, put it down, then lift {colors.1}.", 2),
            Wording("Lift {colors.0}, put it down, then lift {colors.1}.", 2),
            Wording("Lift {colors.0}, set it down, and lift {colors.1}.", 2),
        ),
        test=(
            Wording("Keep the video in mind and raise {colors.0}."),
            Wording("Going by what you saw, raise {colors.0}."),
            Wording("Pick up {colors.0}."),
            Wording("First raise {colors.0}, put it back, then raise {colors.1}.", 2),
            Wording("Pick up {colors.0}, put it back, and pick up {colors.1}.", 2),
            Wording("Raise {colors.0}, set it back, and raise {colors.1}.", 2),
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
)
