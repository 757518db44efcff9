"""The reasoning setting: the goal follows from an intermediate reference in the context.

Every task lists its patterns, and the episodes cycle through them. The command states the slots
that the pattern does not cover.
"""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.core.episode import Goal
from roboirg.core.goal_slots import COLOR_SLOTS
from roboirg.language.instruction import Instruction
from roboirg.language.patterns import Pattern, find_pattern
from roboirg.language.request import InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.settings.setting import Setting
from roboirg.language.slot_types import stated

_COLOR_SLOTS = frozenset(COLOR_SLOTS)
_DERIVED = {
    "color exclusion": _COLOR_SLOTS,
    "number deduction": frozenset(("repeats", "counts", "visit", "placement")),
    "sequential relation": frozenset(("visit", "placement", "relation")),
    "contextual logic": frozenset(("colors", "relation")),
}
"""The slots that each reasoning pattern hides."""
_HIDE_ONLY_COLOR = ("color exclusion", "contextual logic")

BLOCK = 4
"""Number of episodes after which difficulties repeat; see `pattern_of`."""


NamedPattern = tuple[str, Pattern]
"""The name of a reasoning pattern, and how it derives the goal."""


def turn_of(request: InstructionRequest, possible: Sequence[NamedPattern]) -> NamedPattern:
    """Return an episode's main pattern.

    Cycle through the patterns that the episode allows, so that none takes the turns of another.
    Move on by one more after each block of four episodes: otherwise a task with two patterns
    would use only one of them in its hard episodes.
    """
    index = request.episode.index
    return possible[(index + index // BLOCK) % len(possible)]


def say(request: InstructionRequest) -> InstructionSpec:
    """Return an intermediate reference, and a command that derives the goal from it."""
    found = [(name, find_pattern(name, request)) for name in request.task.commands.patterns]
    possible = [(name, pattern) for name, pattern in found if pattern is not None]
    return say_pattern(request, *turn_of(request, possible))


def say_pattern(request: InstructionRequest, name: str, pattern: Pattern) -> InstructionSpec:
    """Return the context of a pattern, and the command that follows from it."""
    derived = pattern.derive(request)
    command = request.command(stated(request) | derived.fields)
    utterances = (
        UtteranceSpec("introduction", derived.context),
        UtteranceSpec("command", command),
    )
    notes = {"pattern": name, **derived.notes}
    return InstructionSpec(utterances, notes)


def hidden_slots(instruction: Instruction, goal: Goal) -> frozenset[str]:
    """Return the slots of the goal that the episode's pattern derives, or its words point at."""
    last = len(instruction.utterances) - 1
    pointed = {
        mention.slot
        for mention in instruction.mentions
        if mention.utterance == last and mention.role == "anaphor"
    }
    derived = _DERIVED[str(instruction.metadata["pattern"])]
    return frozenset(goal.as_mapping()) & (derived | pointed)


def hides_only_color(instruction: Instruction) -> bool:
    """Return whether the pattern hides a color and nothing else."""
    return instruction.metadata["pattern"] in _HIDE_ONLY_COLOR


SETTING = Setting(
    name="reasoning",
    order=2,
    summary="the context gives an intermediate reference, from which the goal is derived",
    color="#D55E00",
    say=say,
    reads=frozenset({"delivery"}),
    hidden_slots=hidden_slots,
    hides_only_color=hides_only_color,
    example=3,
)
