"""Negations: find the words that forbid or exclude something.

Exclusions such as ``a color other than red`` and ``the one of these two that is not red`` are read
in `descriptions`, and ``not that moment`` in `temporal_relations`. Every other negation is a gap:
what a speaker does not want says too little about the goal.
"""

from __future__ import annotations

import re

from roboirg.reader.phrases import Phrases
from roboirg.reader.temporal_relations import NOT_NAMED, NOT_THAT
from roboirg.reader.tokens import COLOR, NUMBER, THING, Sentence, word_set
from roboirg.reader.vocabulary import GERUNDS, VERBS, may_be_verb

VERB = rf"(?:{'|'.join(sorted(VERBS))})\b"
"""A regular expression for a known verb."""
OBJECT = (
    rf"(?:the|an?|it|them|this|these|those|all|any|every|each|both|another|everything"
    rf"|that (?:{THING}|one)|{NUMBER}|{COLOR})\b"
)
"""A regular expression for the first words of a verb's object."""

_REMARK = r"(?:forget|worry|mind|hesitate|matter|care)\b"
"""Verbs whose negation forbids nothing: ``do not forget to press the button``."""
_START = r"(?:^|[,;:] |\b(?:and|but|then|so|or|also|you|now|first|finally|try) )"
_NOT = r"(?:not|dont|never)(?: (?:to|ever|even)\b)*"
_DO_NOT = rf"{_START}(?:(?:do|must|should|may|can|will) )?{_NOT} (?!{_REMARK})"
_PROHIBITION = Phrases({
    "You must not put the red cube into the bin.": rf"{_DO_NOT}{VERB}",
    "Do not stack the red cubes.": rf"{_DO_NOT}(?P<verb>\w+) {OBJECT}",
    "Avoid the red cube.": rf"{_START}(?:avoid|refrain from) {OBJECT}",
    "Avoid putting the red cube into the bin.":
        rf"{_START}(?:avoid|refrain from) (?P<gerund>\w+)\b",
    "I do not want you to put the red cube into the bin.":
        r"\b(?:do|does|did|would) not (?:want|need|wish|like|expect|have|ask)"
        rf"(?: \w+){{0,3}} to {VERB}",
})  # fmt: skip
_NEGATION = Phrases(
    {
        "Put the red cube not in the bin.": "not|never|dont",
        "Avoid the red cube.": "avoid|refrain",
        "Put no red cubes into the bin.": "no|none|nothing",
        "Put the red cube nor the blue one into the bin.": "nor",
        "Put the blue cube instead of the red cube into the bin.": "without|instead|rather than",
        "Put minus two red cubes into the bin.": rf"minus(?= {NUMBER}\b)",
        "Stop putting red cubes into the bin.": rf"stop(?= (?:{'|'.join(sorted(GERUNDS))})\b)",
        "Take the except red cube.": "except|apart from|outside",
    "Put neither cube into the bin.":
            rf"neither(?= (?:the )?(?:{COLOR}|{THING}|container)\b)",
        "Put all cubes but the red ones into the bin.":
            r"(?:all|any|every|anything|everything)(?: \w+){0,2}"
            rf" but(?! (?:to|then|first|{VERB}))",
    },
    before=r"(?:\b(?:do|does|did|must|should|may|can|will|would|is|are) )?\b(?P<negation>",
    after=rf")\b(?: (?:to|ever|even|from|of|the|an?|any)\b)*(?: {COLOR}\b)?"
    r"(?: (?!and\b|or\b)\w+)?",
)  # fmt: skip
_FIXTURE = r"(?:the |a |any )?(?:bin|button|container|target|table|disc)\b"
_OF_COLORS = r"\b(?:painted|colored|with|in|is|are) neither"
_READ_ELSEWHERE = Phrases({
    "Take a cube whose color is not among those.":
        rf"\bnot (?:in|of|among|one of|part of)\b(?! {_FIXTURE})",
    "Take the one of these two that is not blue.":
        r"\bthe (?:one|color|other|other one|other color) (?:of|in|from)\b.*?\bnot\b",
    "Put it where it was when it was not before but after the press.": NOT_NAMED,
    "Put it where it was placed, but not at that moment.": NOT_THAT,
    "Put it where it was at whichever of the two I did not choose.":
        r"\bwhichever\b.*?\bnot\b",
    "Do not forget to press the button.": rf"\bnot {_REMARK}",
    "Stop the cube on visit no 3.": rf"\b(?:visit|pass|placement|time|stay|number) no {NUMBER}\b",
    "Take a cube of any color except red.":
        r"\b(?:color|cube|one|box|tape) (?:except|apart from|outside)\b"
        rf"(?= (?:for )?(?:the|those|that|these|this|{COLOR})\b)",
    "Take the cube that is neither red nor blue.": rf"{_OF_COLORS} {COLOR} n?or {COLOR}\b",
    "Take the cube that is neither of those.": rf"{_OF_COLORS} of (?:those|these|them|the two)\b",
    "Stop the cube on the visit whose number is that minus 4.":
        rf"\b(?:that|it|this|once|twice|thrice|{NUMBER})(?: many)?(?: times)? minus\b",
})  # fmt: skip
"""Ways that other modules read; they may overlap."""


NOT_AT = Phrases({
    "It is not the one":
        r"\b(?:not|never|neither|nor|without|unlike|except|forget"
        r"|(?:any|every|all)\w*(?: \w+)? but)"
        r"(?: (?:take|pick|lift|use|choose|want|need|mean|up|about|the|an?|one|cube|container|that"
        r"|it|is|are|was|stands|even|now|at|on|in|to))*$",
})  # fmt: skip
"""What stands before the words for a place, such as *closest to you*, if the thing is not there."""
_FORBIDDING = word_set("not dont never avoid refrain")
"""Every phrase of `_PROHIBITION` has one of these words."""


def is_negated_command(words: Sentence) -> bool:
    """Return whether a sentence forbids something: ``do not put the cube there``."""
    return not _FORBIDDING.isdisjoint(words) and bool(_prohibitions(" ".join(words)))


def unread_negations(words: Sentence) -> tuple[str, ...]:
    """Return the words of the negations that no other module reads."""
    text = " ".join(words)
    read = [
        found for pattern in _READ_ELSEWHERE.by_example.values() for found in pattern.finditer(text)
    ]
    prohibitions = _prohibitions(text)
    return tuple(
        found[0]
        for found in _NEGATION.finditer(text)
        if _covered(found, prohibitions) or not _covered(found, read)
    )


def _prohibitions(text: str) -> list[re.Match[str]]:
    return [
        found
        for found in _PROHIBITION.finditer(text)
        if (found["verb"] is None or may_be_verb(found["verb"]))
        and (found["gerund"] is None or found["gerund"] in GERUNDS)
    ]


def _covered(negation: re.Match[str], others: list[re.Match[str]]) -> bool:
    at = negation.start("negation")
    return any(other.start() <= at < other.end() for other in others)
