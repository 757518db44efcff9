"""Pairing: settings and forms of an episode share their words, except those under study."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

from roboirg.core.episode import Episode
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.generator import find_refusal, instruct_with
from roboirg.language.instruction import Instruction, Mention
from roboirg.language.settings import all_settings
from roboirg.language.settings.setting import Instruct


def unpaired(
    episode: Episode, settings: Sequence[str], wordings: str | None = None
) -> Iterator[tuple[str, str]]:
    """Yield settings whose words differ from their counterpart, each with the difference.

    Args:
        episode: what to say.
        settings: names.
        wordings: identity of an open wording file; None for our own words.
    """

    def say(options: InstructionOptions) -> Instruction:
        return instruct_with(episode, replace(options, wordings=wordings))

    for name in settings:
        for complaint in all_settings()[name].pairing_rules(say):
            yield name, complaint
        options = InstructionOptions(name, wordings=wordings)
        if find_refusal(episode, options) is None:
            yield from ((name, complaint) for complaint in _differences(options, say))


def _differences(options: InstructionOptions, say: Instruct) -> Iterator[str]:
    """Yield how the forms of an instruction differ, apart from their references."""
    implicit, resolved = say(options), say(replace(options, form="resolved"))
    if implicit.turns[:-1] != resolved.turns[:-1]:
        yield "resolved, its context differs"
    # In words from outside, one time may have a sentence of its own, without a number; but both
    # forms have our own command, or none of them.
    templates = {str(one.metadata["command"]) for one in (implicit, resolved)}
    same = len(templates) == 1 or "own" in templates
    if same and without_references(implicit) != without_references(resolved):
        yield "resolved, more than its references differ"
    if all_settings()[options.setting].implicit and implicit.command == resolved.command:
        yield "resolved, its command is still the implicit one"
    if any(mention.role == "anaphor" for mention in _command_mentions(resolved)):
        yield "resolved, its command still points back"


def without_references(instruction: Instruction) -> str:
    """Return the command with a mark in the place of every mention."""
    text = instruction.command
    for mention in reversed(_command_mentions(instruction)):
        text = f"{text[: mention.start]}@{text[mention.end :]}"
    text = re.sub(r"@ (up|down)\b", r"\1 @", text)  # "pick it up", "pick up the red cube"
    return re.sub(r"@(?:(?:,| and|) @)+", "@", text)  # "exactly those", "two red cubes and one ..."


def _command_mentions(instruction: Instruction) -> list[Mention]:
    last = len(instruction.utterances) - 1
    return [mention for mention in instruction.mentions if mention.utterance == last]
