"""What no text may say, whatever its scenario: grammar, and words for more things than there are.

These rules see the words as they are heard; `sentence_rules` sees them as they are written.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping

from roboirg.core.episode import ALL_COLORS
from roboirg.core.motions import Swap
from roboirg.language.instruction import Instruction
from roboirg.language.number_words import CARDINALS, ORDINALS
from roboirg.language.request import InstructionRequest
from roboirg.language.scenarios.choice import Chosen

_ARTICLE = "an?|the|my|your|his|their|our|its"
_BEGINNING_ARTICLE = "An?|The|My|Your|His|Their|Our|Its"
_VALUE = rf"(?:the )?(?:{'|'.join((*ALL_COLORS, *CARDINALS, *ORDINALS))})(?: (?:cube|one|pass))?"
_PERSON = r"(?:[A-Z][a-z]+|[Mm]y [a-z]+|I)"
_SINGULAR = (
    "is|was|has|isn't|wasn't|hasn't|doesn't|does|goes|gets|needs|takes|wants|says|comes|looks|likes"
)
"""Verbs of a single thing or person."""
_SINGULAR_NOUN = "time|cube|container|lap|pass|visit|person|kid"
GRAMMAR: Mapping[str, str] = {
    r"(?i)\b([a-z']+) \1\b": "a word is doubled",
    rf"(?:\b(?:{_ARTICLE})|(?:^|[.!?:] )(?:{_BEGINNING_ARTICLE})) (?:{_ARTICLE}|her)\b": (
        "these are two articles"
    ),
    r"(?:\ba|(?:^|[.!?:] )A) (?!one\b|once\b|us[aeiu]|uni|eu)[aeiou]\w*": "'an' is right",
    r"\b[Aa]n (?:(?![aeiou]|hour|honest|honor|heir)|one\b|once\b|us[aeiu]|uni|eu)\w*": (
        "'a' is right"
    ),
    r" [.,;:?!]|  |^ | $|[,.][,.]": "a space or mark is too many",
    r"[a-z](?:[.!?][A-Z]|[,;:][A-Za-z])": "a space lacks",
    r"[.!?] [a-z]": "a sentence begins with a capital letter",
    rf"\b{_PERSON} and {_PERSON} (?:{_SINGULAR})\b": "these are several, but the verb is singular",
    rf"\b{_VALUE} and {_VALUE}(?: \w+s)? (?:{_SINGULAR})\b": (
        "these are several, but the verb is singular; before a new sentence there is a comma"
    ),
    rf"(?<!of )\b(?:they|we|both) (?:{_SINGULAR})\b": "the verb is plural",
    r"\b(?:he|she|it) (?:are|aren't|don't|haven't)\b": "the verb is singular",
    rf"\b({_VALUE}|{_PERSON})(?: \w+)? (?:and|or) (?:then )?(?:the )?\1\b": (
        "one thing stands twice"
    ),
    rf"\b(?:{'|'.join(CARDINALS[2:])}|these|those) (?:{_SINGULAR_NOUN})\b": "the noun is plural",
    r"\b(?:once|twice) times?\b": "it is either a number or an adverb",
    r"\b\w+(?:[^aeiou]ys|[cs]hs)\b": "wrong plural; write both, [repeats: try|tries]",
    r"\b(?:[Pp]ut|[Pp]lace|[Ss]et|[Dd]rop|[Ll]ay) (?:the|that) \w+ there\b": (
        "heard as where it goes; say 'pick up' or 'move ... onto'"
    ),
    r"\b(?:one|cube|container) over there\b": "'there' alone is said",
    r"\bon the target (?:on|right then|then|that time)\b": (
        "what points back sounds like a part of the target"
    ),
}
"""Words that are wrong in every text, as patterns, and why."""
_OF_SEVERAL = re.compile(r"\b(?:many|often|each|every|those|them)\b")
_TIME = re.compile(r"\b(?:now|start\w*|began|begin\w*|was|were|at first)\b")
CONTAINER = "container"
"""Pointed at where containers stand over the cubes when the words are heard."""
_LEAST_LETTERS, _OFTEN = 4, 3
_PAIR = 2


def broken_text(told: Instruction) -> Iterator[str]:
    """Yield the rules of grammar that a text breaks."""
    text = told.text
    for pattern, reason in GRAMMAR.items():
        found = re.search(pattern, text)
        if found:
            yield f"says {found[0]!r}; {reason}"
    for turn in told.turns:
        if not turn.endswith((".", "!", "?")):
            yield f"does not end the sentence {turn!r}"
    sentences = Counter(re.split(r"(?<=[.!?]) ", text.lower()))
    for sentence, number in sentences.items():
        if number > 1:
            yield f"has the sentence {sentence!r} twice"
    for mention in told.mentions:
        turn = told.turns[mention.utterance]
        around = turn[: mention.start][-1:] + turn[mention.end :][:1]
        span = told.span(mention)
        if re.search(r"\w", around):
            yield f"joins {span!r} to another word"
        after = re.match(r" (people|[a-z]+[^su]s)\b", turn[mention.end :])
        if span.lower() == "one" and after and after[1] not in _SINGULAR.split("|"):
            yield f"says {f'{span} {after[1]}'!r}; one takes a singular"


def miscounted(told: Instruction, chosen: Chosen, request: InstructionRequest) -> Iterator[str]:
    """Yield words that point back at more things than the text or the goal has."""
    listed = len(chosen.introduced.values.get("list", ()))
    numbers = [value.number for value in request.values_of("number")]
    last = len(told.turns) - 1
    for mention in told.mentions:
        span, kind = told.span(mention), mention.expression
        is_single = " and " not in str(mention.value)
        is_number = isinstance(mention.value, int) and mention.utterance == last
        if numbers == [1] and is_number and kind and _OF_SEVERAL.search(span):
            yield f"says {span!r} of one"
        if is_single and (kind == "pair" or (kind == "them" and span.lower() == "both")):
            yield f"says {span!r} of one thing"
        if listed and is_single:
            wanted = {"former": _PAIR, "latter": _PAIR, "other": _PAIR}.get(str(kind), listed)
            if wanted != listed or (kind in ("first", "second", "third") and listed < _PAIR):
                yield f"says {span!r} of a list of {listed}"


def timeless(told: Instruction, request: InstructionRequest) -> Iterator[str]:
    """Yield a place of things that change places, without a word for when they are there."""
    swaps = request.episode.scene.motions_of(Swap)
    is_described = told.setting == "grounded" and request.task.commands.pointed == CONTAINER
    goes_there = any(mention.expression == "there" for mention in told.mentions)
    if swaps and (is_described or goes_there) and not _TIME.search(told.text):
        yield "says a place without a time, though things change places"


def often_said(text: str, usual: str) -> Iterator[str]:
    """Yield long words that a text has three times or more; `usual` has the words that may be."""
    for word, number in Counter(_words(text)).items():
        if number >= _OFTEN and len(word) >= _LEAST_LETTERS and word not in _words(usual):
            yield word


def _words(text: str) -> list[str]:
    return re.findall(r"[a-z']+", text.lower())
