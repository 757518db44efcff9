"""Open reasoning: the goal follows from the scene and the words together, from no single word."""

from __future__ import annotations

from roboirg.language.open_reasoning import OPEN_PATTERNS
from roboirg.language.request import InstructionRequest, InstructionSpec
from roboirg.language.settings import reasoning
from roboirg.language.settings.setting import Setting
from roboirg.tasks import Task


def refusal(request: InstructionRequest) -> str | None:
    """Return why an episode allows no open pattern; None if it allows one."""
    if reasoning.possible_patterns(request, OPEN_PATTERNS):
        return None
    if len(request.values_of("amount")) > 2:  # noqa: PLR2004 - a color and its count
        return "open reasoning derives one number of cubes or one color, and the goal has several"
    return "no open pattern singles out the goal in this scene"


def say(request: InstructionRequest) -> InstructionSpec:
    """Return an intermediate reference, and a command that derives the goal from it."""
    possible = reasoning.possible_patterns(request, OPEN_PATTERNS)
    return reasoning.say_pattern(request, *reasoning.turn_of(request, possible))


def _applies_to(task: Task) -> bool:
    """Return whether a task has an open pattern; excluding one of PutInBox's boxes leaves one."""
    return task.name != "PutInBox"


SETTING = Setting(
    name="reasoning-open",
    order=reasoning.SETTING.order,
    summary="reasoning, from patterns that no single word gives away",
    color="#E69F00",
    say=say,
    applies_to=_applies_to,
    refusal=refusal,
    reads=reasoning.SETTING.reads,
    example=3,
    plain=reasoning.SETTING.name,
)
