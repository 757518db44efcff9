"""The reasoning setting: the goal follows from an intermediate reference in the context.

Every task lists its patterns, and the episodes cycle through them. The command states the slots
that the pattern does not cover.
"""

from __future__ import annotations

from roboirg.core.episode import Goal
from roboirg.core.goal_slots import COLOR_SLOTS
from roboirg.core.instruction_options import DEFAULT_REASONING, REASONINGS
from roboirg.language.instruction import Instruction
from roboirg.language.open_reasoning import OPEN_PATTERNS
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


def pattern_of(request: InstructionRequest) -> tuple[str, Pattern]:
    """Return the name of an episode's main pattern, and how it derives the goal.

    Cycle through the patterns that the episode allows, so that none takes the turns of another.
    Move on by one more after each block of four episodes: otherwise a task with two patterns
    would use only one of them in its hard episodes.
    """
    possible = possible_patterns(request)
    index = request.episode.index
    return possible[(index + index // BLOCK) % len(possible)]


def possible_patterns(request: InstructionRequest) -> list[tuple[str, Pattern]]:
    """Return the patterns that the episode allows: of the task's own ones, or of the open ones."""
    if is_open(request):
        found = [(name, find_pattern(name, request, OPEN_PATTERNS)) for name in OPEN_PATTERNS]
    else:
        found = [(name, find_pattern(name, request)) for name in request.task.commands.patterns]
    return [(name, pattern) for name, pattern in found if pattern is not None]


def is_open(request: InstructionRequest) -> bool:
    """Return whether the options ask for open reasoning."""
    return request.options.reasoning != DEFAULT_REASONING


def refusal(request: InstructionRequest) -> str | None:
    """Return why an episode allows no open pattern; every episode allows a plain one."""
    if not is_open(request) or possible_patterns(request):
        return None
    if len(request.values_of("amount")) > 2:  # noqa: PLR2004 - a color and its count
        return "open reasoning derives one number of cubes or one color, and the goal has several"
    return "no open pattern singles out the goal in this scene"


def say(request: InstructionRequest) -> InstructionSpec:
    """Return an intermediate reference, and a command that derives the goal from it."""
    name, pattern = pattern_of(request)
    derived = pattern.derive(request)
    command = request.command(stated(request) | derived.fields)
    utterances = (
        UtteranceSpec("introduction", derived.context),
        UtteranceSpec("command", command),
    )
    notes = {"pattern": name, "reasoning": request.options.reasoning, **derived.notes}
    return InstructionSpec(utterances, notes)


def _hidden_slots(instruction: Instruction, goal: Goal) -> frozenset[str]:
    """Return the slots of the goal that the episode's pattern derives, or its words point at."""
    last = len(instruction.utterances) - 1
    pointed = {
        mention.slot
        for mention in instruction.mentions
        if mention.utterance == last and mention.role == "anaphor"
    }
    derived = _DERIVED[str(instruction.metadata["pattern"])]
    return frozenset(goal.as_mapping()) & (derived | pointed)


SETTING = Setting(
    name="reasoning",
    order=2,
    summary="the context gives an intermediate reference, from which the goal is derived",
    color="#D55E00",
    say=say,
    refusal=refusal,
    reads=frozenset({"delivery", "reasoning"}),
    variants=({}, {"reasoning": REASONINGS[-1]}),
    hidden_slots=_hidden_slots,
    hides_only_color=lambda instruction: instruction.metadata["pattern"] in _HIDE_ONLY_COLOR,
    example=3,
)
