"""Negations: find the words that forbid or exclude something.

Exclusions such as ``a color other than red`` and ``the one of these two that is not red`` are read
in `descriptions`, and ``not that moment`` in `temporal_relations`. Every other negation is a gap:
what a speaker does not want tells too little about the goal.
"""

from __future__ import annotations

import re

from roboirg.reader.tokens import COLOR, NUMBER, THING, Sentence
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
_PROHIBITION = re.compile(
    rf"{_START}(?:(?:do|must|should|may|can|will) )?{_NOT} (?!{_REMARK})"
    rf"(?:{VERB}|(?P<verb>\w+) {OBJECT})"
    rf"|{_START}(?:avoid|refrain from) (?:{OBJECT}|(?P<gerund>\w+)\b)"
    r"|\b(?:do|does|did|would) not (?:want|need|wish|like|expect|have|ask)"
    rf"(?: \w+){{0,3}} to {VERB}"
)
_NEGATION = re.compile(
    r"(?:\b(?:do|does|did|must|should|may|can|will|would|is|are) )?"
    r"\b(?P<negation>not|never|dont|avoid|refrain|no|none|nothing|nor|without|instead|rather than"
    rf"|minus(?= {NUMBER}\b)|stop(?= (?:{'|'.join(sorted(GERUNDS))})\b)"
    rf"|neither(?= (?:the )?(?:{COLOR}|{THING}|container)\b)"
    rf"|(?:all|any|every|anything|everything)(?: \w+){{0,2}} but(?! (?:to|then|first|{VERB})))\b"
    rf"(?: (?:to|ever|even|from|of|the|an?|any)\b)*(?: {COLOR}\b)?(?: (?!and\b|or\b)\w+)?"
)
_FIXTURE = r"(?:the |a |any )?(?:bin|button|container|target|table|disc)\b"
_READ_ELSEWHERE = tuple(
    re.compile(pattern)
    for pattern in (
        rf"\bnot (?:in|of|among|one of|part of)\b(?! {_FIXTURE})",
        r"\bthe (?:one|color|other|other one|other color) (?:of|in|from)\b.*?\bnot\b",
        r"\bnot (?:the |one |right |just |moment |at |directly )*(?:before|after)\b",
        r"\bnot (?:at |in )?(?:that|this|it|the one|the moment|when)\b",
        r"\bwhichever\b.*?\bnot\b",
        rf"\bnot {_REMARK}",
        r"\b(?:she|he) (?:would|did|does) not\b",
        rf"\bno {NUMBER}\b",
        rf"\b(?:painted|colored|with|in|is|are) neither {COLOR} n?or {COLOR}\b",
        r"\b(?:painted|colored|with|in|is|are) neither of (?:those|these|them|the two)\b",
        rf"\b{COLOR} or {COLOR} , not {COLOR}\b",
        rf"\b(?:that|it|this|{NUMBER}) minus\b",
    )
)


def is_negated_command(words: Sentence) -> bool:
    """Return whether a sentence forbids something: ``do not put the cube there``."""
    return bool(_prohibitions(" ".join(words)))


def unread_negations(words: Sentence) -> tuple[str, ...]:
    """Return the words of the negations that no other module reads."""
    text = " ".join(words)
    read = [found for pattern in _READ_ELSEWHERE for found in pattern.finditer(text)]
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
