"""Open reasoning: the goal follows from the scene and the words together, from no single word."""

from __future__ import annotations

from roboirg.language.open_reasoning import OPEN_PATTERNS
from roboirg.language.patterns import find_pattern
from roboirg.language.request import InstructionRequest, InstructionSpec
from roboirg.language.settings import reasoning
from roboirg.language.settings.setting import Setting


def possible_patterns(request: InstructionRequest) -> list[reasoning.NamedPattern]:
    """Return the open patterns that the episode allows."""
    found = [(name, find_pattern(name, request, OPEN_PATTERNS)) for name in OPEN_PATTERNS]
    return [(name, pattern) for name, pattern in found if pattern is not None]


def refusal(request: InstructionRequest) -> str | None:
    """Return why an episode allows no open pattern; None if it allows one."""
    if possible_patterns(request):
        return None
    if len(request.values_of("amount")) > 2:  # noqa: PLR2004 - a color and its count
        return "open reasoning derives one number of cubes or one color, and the goal has several"
    return "no open pattern singles out the goal in this scene"


def say(request: InstructionRequest) -> InstructionSpec:
    """Return an intermediate reference, and a command that derives the goal from it."""
    return reasoning.say_pattern(request, *reasoning.turn_of(request, possible_patterns(request)))


SETTING = Setting(
    name="reasoning-open",
    order=reasoning.SETTING.order,
    summary="reasoning, from patterns that no single word gives away",
    color="#E69F00",
    say=say,
    refusal=refusal,
    hidden_slots=reasoning.hidden_slots,
    reads=reasoning.SETTING.reads,
    hides_only_color=reasoning.hides_only_color,
    example=3,
    plain=reasoning.SETTING.name,
)
