"""Corrections: *the red, no, the blue cube*, *twice, I mean three times*: the last value counts."""

from __future__ import annotations

import functools

from roboirg.reader.command import is_command
from roboirg.reader.phrases import Phrases
from roboirg.reader.tokens import COLOR, NUMBER, ORDINAL, Sentence, word_set

_TRIGGERS = word_set("but no mean sorry wait actually")
_REPAIR = r"(?:[,;] )?(?:no wait|wait no|oh no|no sorry|no|i mean|sorry|actually|wait)(?: [,;])?"
_TIMES = rf"(?:{NUMBER} times?|once|twice|thrice|{NUMBER})"
_THE = r"(?:(?:do it|the|a|an|at|on|to|over|in) )*"


_CORRECTIONS = Phrases({
    "not the first time but the second time":
        rf"\bnot (?:on |at )?(?:the )?{ORDINAL}(?: \w+)? ,? ?but (?:on |at )?(?:the )?(?P<instead>{ORDINAL})\b",
    "the red no the blue cube": rf"\b{COLOR}(?: cubes?| ones?| container)* {_REPAIR} {_THE}"
                                rf"(?P<color>{COLOR})\b",
    "twice no three times": rf"\b{_TIMES} {_REPAIR} {_THE}(?P<times>{_TIMES})\b",
    "the second I mean the third time":
        rf"\b(?:{ORDINAL}|last)(?: \w+)?? {_REPAIR} {_THE}(?P<rank>{ORDINAL}|last)\b",
    "before I mean after": rf"\b(?:before|after) {_REPAIR} {_THE}(?P<when>before|after)\b",
})  # fmt: skip


@functools.lru_cache(maxsize=4096)
def corrected(words: Sentence) -> Sentence:
    """Return a commanding sentence with the values to which it corrects itself."""
    if _TRIGGERS.isdisjoint(words) or not is_command(words):
        return words
    text = " ".join(words)
    while (found := _CORRECTIONS.search(text)) is not None:
        value = next(one for one in found.groupdict().values() if one)
        text = text[: found.start()] + value + text[found.end() :]
    return tuple(text.split())
