"""The reasoning setting: the goal follows from an intermediate reference in the context.

The episodes of a task cycle through the patterns that they allow. The command states the slots
that the pattern does not cover.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from roboirg.core.episode import Episode
from roboirg.language.patterns import PATTERNS, Pattern
from roboirg.language.request import InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.settings.setting import Setting
from roboirg.language.slot_types import stated

Turn = TypeVar("Turn")
BLOCK = 4
"""Number of episodes after which difficulties repeat; see `in_turn`."""


NamedPattern = tuple[str, Sequence[Pattern]]
"""The name of a reasoning pattern, and its rules, each of which derives the goal."""


def in_turn(episode: Episode, patterns: Sequence[Turn]) -> Turn:
    """Return an episode's main pattern of those that it allows.

    Cycle through the patterns that the episode allows, so that none takes the turns of another.
    Move on by one more after each block of four episodes: otherwise a task with two patterns
    would use only one of them in its hard episodes.
    """
    return patterns[(episode.index + episode.index // BLOCK) % len(patterns)]


def say(request: InstructionRequest) -> InstructionSpec:
    """Return an intermediate reference, and a command that derives the goal from it."""
    name, rules = in_turn(request.episode, possible_patterns(request))
    rule = rules[0] if len(rules) == 1 else request.sampler.pick(f"{name} rule", rules)
    derived = rule.derive(request)
    utterances = (
        UtteranceSpec("introduction", derived.context),
        UtteranceSpec("command", request.command(stated(request) | derived.fields)),
    )
    notes = {"pattern": name, **derived.notes}
    return InstructionSpec(utterances, notes)


def possible_patterns(request: InstructionRequest) -> list[NamedPattern]:
    """Return the patterns that the episode allows, each with the rules that derive its goal."""
    found = [
        (name, [one for one in rules if one.allows(request)]) for name, rules in PATTERNS.items()
    ]
    return [(name, rules) for name, rules in found if rules]


SETTING = Setting(
    name="reasoning",
    order=2,
    summary="the context gives an intermediate reference, from which the goal is derived",
    color="#D55E00",
    say=say,
    reads=frozenset({"delivery", "language"}),
    example=3,
    offers="reasoning",
)
