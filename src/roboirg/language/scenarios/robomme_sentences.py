"""Whether sentences are RoboMME's: a wording file with its name must state goals as it does."""

from __future__ import annotations

from roboirg.core.errors import InvalidValueError
from roboirg.core.word_pools import ROBOMME_NAME
from roboirg.language.goal_fields import unordered
from roboirg.language.scenarios.literals import Literals
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


def check_robomme_name(name: str, task: str, literals: Literals, where: str) -> None:
    """Check that words named after RoboMME are RoboMME's in every published episode of a task.

    Args:
        name: of the wordings; only ``robomme`` is checked.
        task: its name.
        literals: the sentence of each goal.
        where: the file, for messages.

    Raises:
        InvalidValueError: a sentence is another one than RoboMME's.
    """
    is_known = name == ROBOMME_NAME and task in FINGERPRINTS
    if is_known and fingerprint(task, literals) != FINGERPRINTS[task]:
        raise InvalidValueError(
            f"{where} is named {ROBOMME_NAME!r}, but its sentences of {task} are not those of "
            "RoboMME's published evaluation; give it another name."
        )


def fingerprint(task: str, literals: Literals) -> str:
    """Return a hash of what sentences say in RoboMME's published episodes of a task.

    It is compared with `FINGERPRINTS`. A goal without a sentence counts as an empty one.
    """
    said = [literals.get(unordered(goal), "") for goal in published_goals(task)]
    return short_hash("\n".join(said))
