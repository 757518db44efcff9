"""Selections: remarks that choose one of two introduced values, such as *not the former*.

A remark may name the value that is meant, the one that is not, or both. It is read as words that
point, each of which the words around it accept or reject.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable
from typing import TypeVar

from roboirg.reader.discourse_context import DiscourseContext
from roboirg.reader.tokens import Sentence

Value = TypeVar("Value")

_SAID = r"(?: that)? i (?:just )?(?:mentioned|named|said|listed)"
_POINTER = re.compile(
    r"\bthe (?P<rank>former|latter)\b(?: one)?"
    rf"|\bthe (?P<ordinal>first|second|last) (?:ones?|\w+){_SAID}\b"
    rf"|\bthe (?:ones?|\w+){_SAID} (?P<time>first|earlier|second|last|later)\b"
    r"|\bthe (?P<other>other)(?: (?:ones?|cubes?|box|tape|container|place|number|visit|placement"
    r"|moment))?\b"
)
_FIRST = ("former", "first", "earlier")
_ACCEPTED = re.compile(
    r"\b(?:why not|not (?:do |be |live )?without|not (?:give up|trade|miss|swap|exchange)|but|for)$"
)
_REJECTED = re.compile(
    r"(?:\bnot(?: (?:do|mean|want|choose|like|need|prefer))?"
    r"|\b(?:leave|left|rule|ruled) out|\bset|\b(?:forget|never mind|skip|ignore)(?: about)?"
    r"|\b(?:gave|give) up|\b(?:instead of|rather than)|\b(?:swapped|swap|exchanged)"
    r"|\b(?:prefer(?:red)?|favor|better|more|chose|rather)\b.* (?:to|than|over)"
    r"|\bno (?:means|case|longer|way)|\banything but|\bwithout)$"
)
_REJECTED_AFTER = re.compile(r"^(?:[,;] )?no [,;]|^(?:is|are|was) (?:out|not|off)\b")


@functools.lru_cache(maxsize=8192)
def read_selection(words: Sentence) -> int | None:
    """Return the index of the chosen value, 0 or 1; None if a sentence chooses none of two.

    A sentence that contradicts itself chooses none.
    """
    text = " ".join(words)
    found = list(_POINTER.finditer(text))
    named = [_index(pointer) for pointer in found]
    known = next((index for index in named if index is not None), None)
    if known is None:
        return None
    chosen: set[int] = set()
    for number, (pointer, name) in enumerate(zip(found, named, strict=True)):
        index = 1 - known if name is None else name
        end = found[number + 1].start() if number + 1 < len(found) else len(text)
        rejected = _is_rejected(text[: pointer.start()], text[pointer.end() : end])
        chosen.add(1 - index if rejected else index)
    return chosen.pop() if len(chosen) == 1 else None


def _index(pointer: re.Match[str]) -> int | None:
    """Return 0 or 1; None for *the other*."""
    word = pointer["rank"] or pointer["ordinal"] or pointer["time"]
    return None if word is None else 0 if word in _FIRST else 1


def _is_rejected(before: str, after: str) -> bool:
    """Return whether a pointer is set aside by the words before it, or by those after it."""
    before, after = before.strip(), after.strip()
    if _REJECTED_AFTER.search(after):
        return True
    return _ACCEPTED.search(before) is None and _REJECTED.search(before) is not None


def with_selection(context: DiscourseContext, sentences: Iterable[Sentence]) -> DiscourseContext:
    """Return a context whose pairs have only the chosen value, or the chosen one first.

    Colors and places keep both, because a command may go on with *the other one*.
    """
    chosen = [index for one in sentences if (index := read_selection(one)) is not None]
    if not chosen:
        return context
    index = chosen[-1]
    return context._replace(
        colors=_reordered(context.colors, index),
        places=_reordered(context.places, index),
        numbers=_narrowed(context.numbers, index),
        positions=_narrowed(context.positions, index),
        moments=_narrowed(context.moments, index),
    )


def _reordered(pair: tuple[Value, ...], index: int) -> tuple[Value, ...]:
    return pair if len(pair) != 2 else (pair[index], pair[1 - index])  # noqa: PLR2004


def _narrowed(pair: tuple[Value, ...], index: int) -> tuple[Value, ...]:
    return pair if len(pair) != 2 else (pair[index],)  # noqa: PLR2004
