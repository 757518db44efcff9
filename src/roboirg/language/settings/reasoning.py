"""Reasoning: the context gives an intermediate reference, from which the goal is derived.

Every task lists its patterns; the episodes cycle through them. A slot that the pattern does not
cover is stated explicitly in the command.
"""

from __future__ import annotations

from roboirg.core.episode import Goal
from roboirg.language.instruction import Instruction
from roboirg.language.patterns import Pattern, way
from roboirg.language.request import COLOR_SLOTS, InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.setting import Setting
from roboirg.language.settings.explicit import stated

_COLOR_SLOTS = frozenset(COLOR_SLOTS)
_DERIVED = {
    "color exclusion": _COLOR_SLOTS,
    "number deduction": frozenset(("repeats", "counts", "visit")),
    "sequential relation": frozenset(("visit", "placement", "relation")),
    "contextual logic": frozenset(("colors", "relation")),
}
"""The slots that each reasoning pattern hides."""
_HIDE_ONLY_COLOR = ("color exclusion", "contextual logic")

BLOCK = 4
"""Difficulties repeat after so many episodes; see `pattern_of`."""


def pattern_of(request: InstructionRequest) -> tuple[str, Pattern]:
    """The main pattern of an episode, by name, and how it derives the goal.

    The cycle goes through the patterns that the episode allows, so that none takes the turns of
    another. It moves on by one more after each block of four episodes: otherwise a task with two
    patterns would use only one of them for its hard episodes.
    """
    ways = [(name, way(name, request)) for name in request.task.commands.patterns]
    possible = [(name, one) for name, one in ways if one is not None]
    index = request.episode.index
    return possible[(index + index // BLOCK) % len(possible)]


def say(request: InstructionRequest) -> InstructionSpec:
    """An intermediate reference, and a command that derives the goal from it."""
    name, pattern = pattern_of(request)
    derived = pattern.derive(request)
    command = request.command(stated(request) | derived.fields)
    said = (UtteranceSpec("introduction", derived.context), UtteranceSpec("command", command))
    return InstructionSpec(said, {"pattern": name, **derived.notes})


def _hidden_slots(instruction: Instruction, goal: Goal) -> frozenset[str]:
    """The slots of the goal that the episode's pattern derives."""
    return frozenset(goal.as_mapping()) & _DERIVED[str(instruction.metadata["pattern"])]


SETTING = Setting(
    name="reasoning",
    order=2,
    summary="the context gives an intermediate reference, from which the goal is derived",
    color="#D55E00",
    say=say,
    hidden_slots=_hidden_slots,
    hides_only_color=lambda instruction: instruction.metadata["pattern"] in _HIDE_ONLY_COLOR,
    example=3,
)
