"""Reasoning: the context gives an intermediate reference, from which the goal is derived.

Every task lists its patterns; the episodes cycle through them. A slot that the pattern does not
cover is stated explicitly in the command.
"""

from __future__ import annotations

from roboirg.language.patterns import Pattern, way
from roboirg.language.request import InstructionRequest, InstructionSpec, Setting, UtteranceSpec
from roboirg.language.settings.explicit import stated

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


SETTING = Setting("reasoning", say)
