"""Alternatives of which one is taken back: *the second or fourth visit but not the second*."""

from __future__ import annotations

import re

from roboirg.reader.phrases import Phrases
from roboirg.reader.tokens import COLOR, NUMBER, ORDINAL, Sentence

_VALUE = rf"(?:{COLOR}|{NUMBER}|{ORDINAL})"
_ONE_LEFT = Phrases({
    "one or two times but not two":
        rf"\b(?P<first>{_VALUE}) or (?P<second>{_VALUE})(?P<noun>(?: \w+){{0,3}}?)"
        r"(?: ,)?(?: but)? not (?:the )?(?P<left_out>(?P=first)|(?P=second))\b",
})  # fmt: skip


def take_remaining(words: Sentence) -> Sentence:
    """Return a sentence with the one of two alternatives that it does not take back."""
    text = " ".join(words)
    found = _ONE_LEFT.search(text)
    if found is None:
        return words
    return take_remaining(
        tuple(f"{text[: found.start()]}{_remaining(found)}{text[found.end() :]}".split())
    )


def _remaining(found: re.Match[str]) -> str:
    taken = found["second"] if found["left_out"] == found["first"] else found["first"]
    return f"{taken}{found['noun']}"
