"""Which explicit sentences are RoboMME's: words with its name must state its goals as it does."""

from __future__ import annotations

from roboirg.core.errors import InvalidValueError
from roboirg.language.worded_command import ROBOMME_NAME, TaskWordings, Wordings
from roboirg.tasks.splits.published_episodes import published_goals
from roboirg.util.short_hash import short_hash

FINGERPRINTS = {
    "PickXtimes": "41681e819f44", "StopCube": "8a2a5e42a094", "SwingXtimes": "3b51faf4753d",
    "BinFill": "5d6286b79ba8", "VideoUnmaskSwap": "d5abfc4c44a3", "VideoUnmask": "e2a3bf31b608",
    "ButtonUnmaskSwap": "c215f34461af", "ButtonUnmask": "6f0552141bad",
    "VideoRepick": "245c352faf9b", "VideoPlaceButton": "bb451183144f",
    "VideoPlaceOrder": "ff66f1039621",
}  # fmt: skip
"""For each task, a hash of what RoboMME's evaluation says in its published episodes."""


def check_robomme_name(wordings: Wordings, where: str) -> None:
    """Check that words named after RoboMME are RoboMME's in every published episode."""
    if wordings.name != ROBOMME_NAME:
        return
    for task, commands in wordings.tasks.items():
        if task in FINGERPRINTS and fingerprint(task, commands) != FINGERPRINTS[task]:
            raise InvalidValueError(
                f"The {where} is named {ROBOMME_NAME!r}, but its sentences of {task} are not "
                "those of RoboMME's published evaluation; give it another name."
            )


def fingerprint(task: str, commands: TaskWordings) -> str:
    """Return the hash of what commands say in RoboMME's published episodes of a task."""
    stated = []
    for goal in published_goals(task):
        command = commands.find(goal)
        stated.append("" if command is None else command.state(goal))
    return short_hash("\n".join(stated))
