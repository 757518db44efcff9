"""Pairing: the settings and forms of an episode share their words but for what is studied."""

from __future__ import annotations

from collections.abc import Iterator

from roboirg.core.episode import Episode
from roboirg.language.generator import instruct
from roboirg.language.instruction import Instruction, Mention
from roboirg.language.settings import EXPLICIT

MANY = 4
"""Distractors of the long context that a short one must be the beginning of."""


def unpaired(episode: Episode, settings: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Settings whose words are not those of their counterpart, each with what is wrong."""
    explicit, direct, contextual = (
        instruct(episode, setting) for setting in ("explicit", "direct", "contextual")
    )
    if instruct(episode, "contextual", stages=(1, 5)).turns != direct.turns:
        yield "contextual", "stages 1 and 5 are not the direct instruction"
    if (contextual.turns[0], contextual.command) != (direct.turns[0], direct.command):
        yield "contextual", "introduction or command are not those of direct"
    if instruct(episode, "direct", "resolved").turns != (direct.turns[0], explicit.command):
        yield "direct", "resolved, its command is not the explicit one"
    long = instruct(episode, "contextual", distractors=MANY)
    if (long.turns[:3], long.turns[-2:]) != (contextual.turns[:3], contextual.turns[-2:]):
        yield "contextual", "few distractors are not the beginning of many"
    for setting in settings:
        implicit = instruct(episode, setting)
        resolved = instruct(episode, setting, "resolved")
        if implicit.turns[:-1] != resolved.turns[:-1]:
            yield setting, "resolved, its context differs"
        if without_references(implicit) != without_references(resolved):
            yield setting, "resolved, more than its references differ"
        if setting != EXPLICIT and implicit.command == resolved.command:
            yield setting, "resolved, its command is still the implicit one"
        if any(mention.role == "anaphor" for mention in _last(resolved)):
            yield setting, "resolved, its command still points back"


def without_references(instruction: Instruction) -> str:
    """The command with a mark in the place of every mention."""
    text = instruction.command
    for mention in reversed(_last(instruction)):
        text = f"{text[: mention.start]}@{text[mention.end :]}"
    return text


def _last(instruction: Instruction) -> list[Mention]:
    """The mentions of the command."""
    last = len(instruction.utterances) - 1
    return [mention for mention in instruction.mentions if mention.utterance == last]
