"""What no text may say, whatever its scenario: grammar, and words for more things than there are.

These rules see the words as they are heard; `sentence_rules` sees them as they are written.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from roboirg.core.episode import ALL_COLORS
from roboirg.core.motions import Swap
from roboirg.language.instruction import Instruction
from roboirg.language.number_words import CARDINALS, ORDINALS
from roboirg.language.request import InstructionRequest
from roboirg.language.scenarios.choice import ScenarioChoice

Patterns = Mapping[str, str]
"""Patterns of wrong words, and why they are wrong."""
_ARTICLE = "an?|the|my|your|his|their|our|its"
_BEGUN = "An?|The|My|Your|His|Their|Our|Its"
"""The same at the beginning of a sentence."""
_VALUE = f"(?:the )?(?:{'|'.join((*ALL_COLORS, *CARDINALS, *ORDINALS))})(?: (?:cube|one|pass))?"
_PERSON = "(?:[A-Z][a-z]+|[Mm]y [a-z]+|I)"
_SINGULAR = (
    "is|was|has|isn't|wasn't|hasn't|doesn't|does|goes|gets|needs|takes|wants|says|comes|looks|likes"
)
"""Verbs of a single thing or person."""
_SIDE = "(?:the|your) (?:far )?(?:left|right)"
_TIME = r"\b(?:now|start\w*|began|begin\w*|was|were|at first)\b"

GRAMMAR: Patterns = {
    r"(?i)\b([a-z']+) \1\b": "a word is doubled",
    r"(?is)(?:^|[.!?]\s)([^.!?]+[.!?])(?=\s(?:.*[.!?]\s)?\1)": "the sentence stands twice",
    r"(?m)[^.!?]$": "the sentence does not end",
    r"[.!?]\s[a-z]": "a sentence begins with a capital letter",
    r" [.,;:?!]|  |(?m:^ | $)|[,.][,.]": "a space or mark is too many",
    r"[a-z](?:[.!?][A-Z]|[,;:][A-Za-z])": "a space lacks",
    rf"(?:\b(?:{_ARTICLE})|(?:^|[.!?:]\s)(?:{_BEGUN})) (?:{_ARTICLE}|her)\b": (
        "these are two articles"
    ),
    r"(?:\ba|(?:^|[.!?:]\s)A) (?!one\b|once\b|us[aeiu]|uni|eu)[aeiou]\w*": "'an' is right",
    r"\b[Aa]n (?:(?![aeiou]|hour|honest|honor|heir)|one\b|once\b|us[aeiu]|uni|eu)\w*": (
        "'a' is right"
    ),
    rf"(?:\b{_PERSON} and {_PERSON}|\b{_VALUE} and {_VALUE}(?: \w+s)?"
    rf"|(?<!of )\b(?i:they|we|both)) (?:{_SINGULAR})\b": "several take a plural",
    r"(?<!\bof )\b(?i:he|she|it) (?:are|aren't|don't|haven't)\b": "one takes a singular",
    rf"\b({_VALUE}|{_PERSON})(?<! one)(?: \w+)? (?:and|or) (?:then )?(?:the )?\1\b": (
        "it is named twice"
    ),
    rf"\b(?:{'|'.join(CARDINALS[2:])}|(?i:these|those))"
    r" (?:time|cube|container|lap|pass|visit|person|kid)\b": "several take a plural",
    r"\b(?:once|twice) times?\b": "it is a number already",
    r"\b\w+(?:[^aeiou]ys|[cs]hs)\b": "wrong plural; write [repeats: one try|several tries]",
    r"\b(?:[Pp]ut|[Pp]lace|[Ss]et|[Dd]rop|[Ll]ay) (?:the|that) \w+ there\b": (
        "heard as where it goes; the verb is 'pick up' or 'move'"
    ),
    r"\b(?:one|cube|container) over there\b": "people say 'there' alone",
    rf"\b(?i:on) the target (?:on(?! {_SIDE})|right then|then|that time)\b": (
        "what points back must not follow 'on the target'"
    ),
}
"""Of the words alone; a line is an utterance."""
MENTIONED: Patterns = {
    r"[\w>]<|>\w": "it is joined to another word",
    rf"<None 1:[Oo]ne> (?!(?:{_SINGULAR})\b)(?:people|[a-z]+[^su]s)\b": "one takes a singular",
    r"<pair \w+:[^>]*>|<them \w+:[Bb]oth>": "this is one thing",
    r"(?s)^(?!.*(?:cube|container|one) <None).*the one <there": "name the thing, 'the cube there'",
}
"""Of the words with their mentions marked, ``<that 3:that many times>``, class and value first."""
MOVED: Patterns = {
    rf"(?s)^(?!.*{_TIME}).*<there (?!before|after)": "things change places; say when they are there"
}
"""The same where things change places; what is put on the target of a moment moves with it."""
OF_LISTS: Mapping[int, Patterns] = {
    1: {r"<(?:former|latter|first|second|third|other) \w+:[^>]*>": "the list has one value"},
    3: {r"<(?:former|latter|other) \w+:[^>]*>": "the list has three values"},
}
"""The same by the length of the list; the others are right for two."""


def broken_text(
    instruction: Instruction, chosen: ScenarioChoice, request: InstructionRequest
) -> Iterator[str]:
    """Yield a complaint for each grammar rule that a text breaks: *says 'a apple'; 'an' is right*.

    Rules about its words come first, then those about words that name a value or point back. Of the
    latter some depend on how many values the text lists, *the latter* of three is wrong, and on
    whether things change places in the scene: then *there* needs a time.

    Args:
        instruction: whose text is checked.
        chosen: the scenario (template) of the text with its fillers, among them those of its list.
        request: with the episode.
    """
    yield from _complaints(GRAMMAR, "\n".join(instruction.turns))
    patterns = dict(MENTIONED)
    length = len(chosen.fillers.values.get("list", ()))
    patterns |= OF_LISTS.get(length, {})
    if request.episode.scene.motions_of(Swap):
        patterns |= MOVED
    yield from _complaints(patterns, _with_marked_mentions(instruction))


def _complaints(patterns: Patterns, text: str) -> Iterator[str]:
    """Yield a complaint for each pattern that is found in a text: *says 'a apple'; 'an' is right*.

    Args:
        patterns: of wrong words, with the reason why they are wrong.
        text: to search.
    """
    for pattern, reason in patterns.items():
        found = re.search(pattern, text)
        if found:
            yield f"says {found[0]!r}; {reason}"


def _with_marked_mentions(instruction: Instruction) -> str:
    """Return the text of an instruction with its mentions marked, as the patterns of rules need it.

    *Lift it.* becomes ``Lift <it red:it>.``: class of the expression, value, and the words. Words
    that name a value have the class None: ``<None red:red>``. A line is an utterance.
    """
    turns = list(instruction.turns)
    # From the end, so that the positions of earlier mentions stay right.
    for mention in reversed(instruction.mentions):
        turn = turns[mention.utterance]
        marked = f"<{mention.expression} {mention.value}:{instruction.span(mention)}>"
        turns[mention.utterance] = turn[: mention.start] + marked + turn[mention.end :]
    return "\n".join(turns)
