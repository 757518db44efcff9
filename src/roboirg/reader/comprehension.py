"""Comprehension: find the parts of a command that no rule reads, and name them.

A command with such a part has no goals: a guess would do what the speaker did not ask for.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import NamedTuple

from roboirg.reader.command import BEFORE_VERB
from roboirg.reader.negations import OBJECT, VERB, unread_negations
from roboirg.reader.phrases import Phrases
from roboirg.reader.places import place_mentions
from roboirg.reader.quantities import quantities
from roboirg.reader.repetitions import more_mentions
from roboirg.reader.several_amounts import several_amounts
from roboirg.reader.tokens import Sentence, color_of, number_of, word_set
from roboirg.reader.vocabulary import (
    DETERMINERS,
    PLACE_WORDS,
    PREPOSITIONS,
    SERIES_NOUNS,
    STEP_NOUNS,
    STEP_WORDS,
    THING_NOUNS,
    UNSEEN_COLORS,
    is_known,
    may_be_verb,
)

_LEAD = (
    r"^(?:(?:and|but|so|then|now|next|first|finally|afterwards|also|after that|[,;:]) )*"
    r"(?:(?:i (?:want|need|ask|would like) you to|(?:can|could|will|would) you"
    r"|you (?:must|should|have to|need to)|try to) )?"
)
_UNKNOWN_COMMAND = Phrases({
    "And then I want you to stack the red cube.":
        rf"{_LEAD}(?P<verb>\w+) (?:(?:up|down|out|away|off|over) )?(?:{VERB} (?:up )?)?{OBJECT}",
})  # fmt: skip
_AFTER_VERB = Phrases({
    "the red cube": OBJECT,
    ", please": "[,;:]",
    "up and down": r"up\b|down\b",
    "": "$",
})  # fmt: skip
_BEFORE_UNKNOWN_VERB = BEFORE_VERB | {"you"}
_COMPARISON = Phrases({
    "fewer than three": r"\b(?P<word>more|fewer|less|further)\b(?: than \w+)?",
    "two cubes than that":
        r"\b(?<!other )(?<!rather )(?<!different )(?<!later )(?<!earlier )(?<!moment )"
        r"(?P<than>than)\b",
    "take the total": r"(?<!in )(?<!times )(?<!cycles )\b(?P<sum>total)\b",
    "half as many": r"\b(?P<part>half|double|triple)\b(?: as)?(?: many| often)?",
})  # fmt: skip
_SWINGING = word_set("swing swinging forth")
CALCULATIONS = word_set("total sum difference gap")
"""What is made of other numbers, which then say nothing about the goal."""
_BOTH_TARGETS = Phrases(
    {
        "both targets": r"(?:target|disc)s\b",
        "the left and the right one": r"(?:left|right)\b.{,20}? and (?:the )?(?:left|right)\b",
        "the target on your left and the target on your right":
            r"(?:target|disc) .{,20}? and the .{,20}?(?:target|disc)\b",
    },
    before="(?:(?:the|both|two|these|those) )*",
)  # fmt: skip
_HIDDEN = Phrases({
    "the container that the red cube is hidden":
        r"(?:^| )(?!(?:that|which) )\w+ (?:is|was|are|were)(?: hidden)?$",
})  # fmt: skip
_BELOW = word_set("under below beneath underneath")
_AFTER_BELOW = ((), (",",), (";",), ("and",), ("then",))
_LOCATING = PREPOSITIONS | PLACE_WORDS


class ComprehensionGap(NamedTuple):
    """A part of a command that the interpreter does not understand.

    Attributes:
        complaint: a plain sentence that names it.
        words: the words in it that no rule reads.
    """

    complaint: str
    words: tuple[str, ...] = ()


def is_unknown_command(words: Sentence) -> bool:
    """Return whether a sentence gives a command with an unknown verb."""
    found = _UNKNOWN_COMMAND.match(" ".join(words))
    return found is not None and may_be_verb(found["verb"])


@functools.lru_cache(maxsize=4096)
def find_gaps(words: Sentence) -> tuple[ComprehensionGap, ...]:
    """Return the parts of a commanding sentence that the interpreter does not understand."""
    negations = unread_negations(words)
    return (
        *(
            ComprehensionGap(f'does not understand the negation "{negation}"')
            for negation in negations
        ),
        *_unknown_words(words),
        *_unread_places(words),
        *_unread_comparisons(words),
    )


def _unknown_words(words: Sentence) -> Iterator[ComprehensionGap]:
    for at, word in enumerate(words):
        if not is_known(word) and not _is_read_alternative(words, at):
            yield ComprehensionGap(f"does not know the {_with_role(words, at)}", (word,))


def _is_read_alternative(words: Sentence, at: int) -> bool:
    """Return whether a word is the *or* of *before or after*, or the *nor* of *neither*."""
    return words[at] in ("or", "nor") and (
        words[at - 1 : at + 2 : 2] == ("before", "after") or "neither" in words[max(0, at - 2) : at]
    )


def _with_role(words: Sentence, at: int) -> str:
    """Return an unknown word with the part of speech that it seems to be."""
    word = words[at]
    before, after = words[at - 1] if at else ",", words[at + 1] if at + 1 < len(words) else ","
    if word in UNSEEN_COLORS:
        return f'color "{word}"'
    if not may_be_verb(word):
        return f'word "{word}"'
    if before in _BEFORE_UNKNOWN_VERB and _AFTER_VERB.match(" ".join(words[at + 1 :])):
        return f'verb "{word}"'
    if after in THING_NOUNS | SERIES_NOUNS or color_of(after) or not is_known(after):
        return f'word "{word}"'
    return _noun(words, at)


def _noun(words: Sentence, at: int) -> str:
    """Return an unknown word that seems to be a noun, as a thing or with the words for a place."""
    noun_phrase = _phrase_start(words, at)
    if not any(is_known(word) for word in words[noun_phrase:at]):
        return f'word "{words[at]}"'
    start = noun_phrase
    while start and words[start - 1] in _LOCATING | {"the"}:
        start -= 1
    if words[start] in _LOCATING:
        return f'place "{" ".join(words[start : at + 1])}"'
    return f'thing "{words[at]}"'


def _phrase_start(words: Sentence, at: int) -> int:
    """Return where the noun phrase that ends with a word begins."""
    while at and (_modifies(words[at - 1]) or not is_known(words[at - 1])):
        at -= 1
    return at


def _modifies(word: str) -> bool:
    """Return whether a word comes before a noun: a determiner, a color or a number."""
    if word in DETERMINERS or word in UNSEEN_COLORS:
        return True
    return color_of(word) is not None or number_of(word) is not None


def _unread_places(words: Sentence) -> Iterator[ComprehensionGap]:
    """Yield the places that `places` cannot read although it knows their words."""
    read = {at for place in place_mentions(words) for at in range(place.start, place.end)}
    has_steps = not STEP_NOUNS.isdisjoint(words)
    for at, word in enumerate(words):
        if at in read or not _locates(words, at) or (has_steps and word in STEP_WORDS):
            continue
        end = at + 1
        while end < len(words) - 1 and (words[end] in _LOCATING or _modifies(words[end])):
            end += 1
        yield ComprehensionGap(
            f'does not know the place "{" ".join(words[at : end + 1])}"', (word,)
        )


def _unread_comparisons(words: Sentence) -> Iterator[ComprehensionGap]:
    """Yield the comparisons that are no part of a number, such as *fewer than three*."""
    text = " ".join(words)
    spans = [(quantity.start, quantity.end) for quantity in quantities(text)]
    spans += [found.span() for found in (*several_amounts(text), *more_mentions(text))]
    for found in _COMPARISON.finditer(text):
        if not any(start <= found.start() < end for start, end in spans):
            yield ComprehensionGap(
                f'does not understand the comparison "{found[0]}"',
                (next(filter(None, found.groups())),),
            )


def _locates(words: Sentence, at: int) -> bool:
    following = words[at + 1 : at + 2]
    if words[at] in ("left", "right"):
        return following == ("of",)
    if words[at] == "between" and not _SWINGING.isdisjoint(words):
        return _BOTH_TARGETS.match(" ".join(words[at + 1 :])) is None  # the way of a cube
    if words[at] in _BELOW and following == ("which",):
        return False  # the container under which the red cube is
    if words[at] in _BELOW and following in _AFTER_BELOW:
        # The container that the red cube is hidden under.
        return _HIDDEN.search(" ".join(words[:at])) is None
    if words[at] == "next":
        return following == ("to",)
    # "The placement closest in time to that one" is no place.
    return words[at] in PLACE_WORDS and words[at + 1 : at + 4] != ("in", "time", "to")
