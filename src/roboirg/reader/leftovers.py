"""Leftovers: what a command names and its reading does not use, or uses twice."""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterator

from roboirg.reader.command import Command
from roboirg.reader.descriptions import CHOSEN
from roboirg.reader.ordinals import named_positions
from roboirg.reader.phrases import Phrases
from roboirg.reader.quantities import quantities, times_mentions
from roboirg.reader.tokens import COLOR, NUMBER, ORDINAL, Sentence, colors_in

_RANK = rf"(?:{ORDINAL}|last)"
_CLASH = Phrases({
    "the green blue cube": rf"\b{COLOR} (?:the )?{COLOR}\b",
    "the second third visit": rf"\b(?:{_RANK}|former|latter) (?:{ORDINAL}|former|latter)\b",
    "that second visit":
        rf"\b(?:that|this) {_RANK}\b|\b{_RANK} that\b(?! (?:hides|covers|is|has)\b)",
    "the other green cube": rf"\bother {COLOR}\b",
    "the second blue of them": rf"\b{_RANK} {COLOR} of\b",
    "green the former": rf"\b{COLOR} (?:\w+ )?the (?:former|latter|other)\b(?! color)",
    "the green over it":
        rf"\b{COLOR} over (?:it|the (?:cube|one) (?:i|other)\b|the (?:former|latter))",
    "a different red box": rf"\bdifferent {COLOR}\b|\bcolor from {COLOR}\b",
    "lift blue the container": rf"\b{COLOR} the (?:container|one|{_RANK})\b",
    "the green cube of a color other than blue":
        rf"\b{COLOR} (?:cube|one|box|tape) of an?\b"
        rf"|\b(?:an?|any|some|other) (?:\w+ )?color {COLOR}\b",
    "the cube I green mean": rf"\bi {COLOR}\b|\b{COLOR} (?:push|press|hit) the\b",
    "two but visits later": rf"\b{NUMBER} but\b(?! (?:only|not)\b)",
    "blue four blue cubes": rf"\b{COLOR} (?!one\b){NUMBER}\b",
    "the other box I want":
        r"\bother (?:cube|box|tape|one|moment|container) (?:i\b|of (?:her|his) choice)",
    "the second cube I want": rf"\b{_RANK} (?:cube|one) i (?!just|mentioned|named|said|listed)\w+",
    "right the second": rf"\b(?:right|just) the {_RANK}\b|\blast the\b",
    "then another one": rf"\banother (?:one|cube|{COLOR})\b(?! color)",
    "but use the other one": r"\bbut (?:use|take|choose|want|prefer) (?:the other|another)\b",
    "on the target times": r"\b(?:target|disc|table|it|down|back|other|button|left|right) times\b",
})  # fmt: skip
"""Words that are each clear, but not together."""


@functools.lru_cache(maxsize=4096)
def left_over(command: Command, slots: tuple[str, ...]) -> tuple[str, ...]:
    """Return a complaint for each kind of value that a command names and that no slot takes."""
    return tuple(_complaints(command, slots))


def _complaints(command: Command, slots: Collection[str]) -> Iterator[str]:
    """Yield a complaint for each of them."""
    text = command.text
    clash = _CLASH.search(text)
    if clash is not None:
        yield f'does not understand "{clash[0]}"'
    pointed = next((words for words in command.handled if _points_too(words)), None)
    if pointed is not None and {"visit", "placement", "relation"}.isdisjoint(slots):
        yield f'does not know which thing is meant by "{" ".join(pointed)}"'
    if "repeats" in slots:
        mentions = times_mentions(text)
        lost = [one for one in quantities(text) if one.plain and one not in mentions]
        for one in lost:
            if (one.expression.quantity or 1) > 1:
                yield f'does not understand "{text[one.start : one.end]}"'
        if len({one.expression for one in mentions}) > 1:
            named = " and ".join(text[one.start : one.end] for one in mentions)
            yield f'does not know which number of times is meant, "{named}"'
    if not {"visit", "placement"}.isdisjoint(slots):
        if len(positions := sorted(set(named_positions(text)))) > 1:
            yield f"does not know which position is meant, {' or '.join(map(str, positions))}"
    elif "relation" not in slots:
        parts = (*command.handled, *command.added, *command.entered)
        used = {color for words in parts for color in colors_in(words)}
        unused = [color for color in colors_in(tuple(text.split())) if color not in used]
        if parts and unused:
            yield f'does not understand what is to be done with "{unused[0]}"'
    if "colors" in slots and "counts" not in slots:
        picked = sum(words.count("container") for words in command.handled)
        if command.handled and text.split().count("container") > picked:
            yield 'does not understand what is to be done with each "container"'


def _points_too(words: Sentence) -> bool:
    """Return whether the words for one thing name a color and point at an introduced one."""
    text = " ".join(words)
    points = not {"former", "latter"}.isdisjoint(words) or CHOSEN.search(text) is not None
    return points and bool(colors_in(words))
