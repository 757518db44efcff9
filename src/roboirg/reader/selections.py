"""Selections: remarks that choose one of two introduced values, such as *not the former*.

A remark may name the value that is meant, the one that is not, or both. It is read as words that
point, each of which the words around it accept or reject.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Sequence
from typing import TypeVar

from roboirg.reader.descriptions import CHOSEN
from roboirg.reader.discourse_context import DiscourseContext, read_remark
from roboirg.reader.phrases import Phrases
from roboirg.reader.tokens import ORDINAL, Sentence

Value = TypeVar("Value")
OPEN = -1
"""Instead of an index: a remark leaves open, or opens again, which of two values is meant."""

_SAID = r"(?: that)? i (?:just )?(?:mentioned|named|said|listed)"
_POINTER = Phrases({
    "I want the former.": r"\bthe (?P<rank>former|latter)\b(?: one)?",
    "I want the first color I mentioned.":
        rf"\bthe (?P<ordinal>first|second|1st|2nd|last) (?:ones?|\w+){_SAID}\b",
    "I want the second one.":
        r"\bthe (?P<bare>first|second|1st|2nd)(?: (?:ones?|number|of (?:them|those|the two))\b"
        rf"(?!{_SAID}\b| from\b)|$)",
    "I want the one I mentioned first.":
        rf"\bthe (?:ones?|\w+){_SAID} (?P<time>first|earlier|second|1st|2nd|last|later)\b",
    "I want the other one.":
        r"\bthe (?P<other>other)(?: (?:ones?|cubes?|box|tape|container|place|number|visit"
        r"|placement|moment))?\b",
})  # fmt: skip
_RANKED = r"\bthe (?:former|latter|first|second|1st|2nd)\b"
_POINTING = frozenset({"it", "that", "other", "then"})
_FIRST = ("former", "first", "1st", "earlier")
_ACCEPTED = Phrases(
    {
        "Why not": "why not",
        "I could not live without": r"not (?:do |be |live )?without",
        "I would not give up": "not (?:give up|part with|trade|miss|swap|exchange|skip)",
        "I would not mind": "not (?:mind|refuse|pass up)",
        "Not the latter, but": "but",
        "I would go for": "(?<!need )(?<!use )for",
    },
    before=r"\b",
    after="$",
)
"""Ways to accept a pointer by the words before it."""
_REJECTED = Phrases(
    {
        "I do not want": r"\bnot(?: (?:do|mean|want|choose|pick|like|need|prefer))?",
        "You may leave out": r"\b(?:leave|left|rule|ruled) out",
        "Save": r"\b(?:save|leave)",
        "Set": r"\bset",
        "Forget about": r"\b(?:forget|never mind|skip|ignore)(?: about)?",
        "I gave up": r"\b(?:gave|give|passed) up",
    "I am done with": r"\bdone with",
    "I decided against": r"\bagainst",
    "I considered": r"\bconsidered",
    "I meant the former when I said": r"\bi said",
        "I want the latter instead of": r"\b(?:instead of|rather than)",
        "I swapped": r"\b(?:swapped|swap|exchanged)",
        "I switched from": r"\b(?:switched|changed)\b.* from",
        "I prefer the latter to":
            r"\b(?:prefer(?:red)?|favor|better|more|chose|rather)\b.* (?:to|than|over)",
        "By no means": r"\bno (?:means|case|longer|way|need for|use for)",
        "Nobody wants":
            r"\b(?:nobody|no one|hardly any(?:one|body))(?: \w+)?? "
            r"(?:(?:want|like|need|love|pick|trust|prefer)(?:s|ed)?|took|chose)",
        "I want anything but": r"\banything but",
        "I would be happy without": r"\bwithout",
    },
    after="$",
)  # fmt: skip
"""Ways to set a pointer aside by the words before it, unless they accept it."""
_REJECTED_AFTER = Phrases({
    "can wait, so start with the latter":
        r"^(?:(?:can|could|may|might|will|would|should|just|still|easily) )*"
        r"(?:waits?|comes? later)\b(?! (?:no|any) longer)|^later(?=$| [,;])",
    "I do not want": "^i (?:do|did|would|will) not",
    ", no, the latter": "^(?:[,;] )?(?:no|sorry) [,;]",
    "or rather": "^(?:[,;] )?or rather$",
    "is out of the question": r"^(?:is|are|was) (?:definitely )?(?:out|not|off)\b",
    "less than the latter": "^less than",
})  # fmt: skip
"""Ways to set a pointer aside by the words after it."""


_CHANGE = Phrases(
    {
        "Scratch that.": r"\b(?:scratch|cancel|undo|strike) (?:it|that|this)\b",
        "On second thought, double it.": r"\bon second thoughts?\b",
        "I take that back.": r"\b(?:take|took) (?:it|that|this) back\b",
        "I have changed my mind.": r"\bchanged? my mind\b",
        "No, double it.": r"^(?:no )?(?:, )?(?:double|triple|halve) (?:it|that|this)$",
    },
)  # fmt: skip
"""Remarks that take back or change what was said before."""
_REOPENED = Phrases({
    "No, I do not.": "^(?:oh )?no(?: [,;]|$)",
    "Actually, the other one.": r"^(?:sorry|wait|actually|or rather|i mean)\b.*\bthe other\b",
    "Let us do both.":
        r"\b(?:do|want|take|need|choose|pick|use|prefer|keep|for)(?: \w+)?? both\b"
        r"|^(?:and|or|yes|no)? ?both$|\bboth (?:can|could|may|will)\b",
})  # fmt: skip
"""Remarks without a rank that take back what was chosen, or choose both of two."""
_TOGETHER = Phrases({
    "Forget the former and the latter.": rf"{_RANKED}(?: ones?)? (?:and|or|nor) {_RANKED}",
    "So can the latter.": r"\bso (?:can|could|may|will|should|does|is) the\b|\bboth can\b",
})  # fmt: skip
"""Remarks that say the same of both."""
_ANEW = Phrases({
    "No, let us do the latter.":
        r"^(?!.*\b(?:also|too|as well)\b)(?:.*\b(?:instead|rather|second thoughts?)\b|(?:oh |and )?"
        r"(?:no|nope|sorry|wait|actually|change|so|let's|i (?:mean|chose|picked|decided))\b)",
})  # fmt: skip
"""Remarks that choose again; without such words, two choices that differ are none."""
_SKIPPED = Phrases({
    "Skip the third one.": rf"\b(?:skip|leave out|rule out)\b(?: \w+)?? (?:the )?{ORDINAL}\b",
    "Do not begin with the latter.": r"\bnot\b.*\bthe (?:former|latter)\b",
})  # fmt: skip
"""Ways to set one of two aside; unread, they leave open which one is meant."""
_ASIDE = Phrases(
    {"I have ruled instead out": r"\b(?:not|no(?! [,;])|never|out|aside|without|instead|up)\b"}
)


@functools.lru_cache(maxsize=8192)
def read_selection(words: Sentence) -> int | None:
    """Return the index of the chosen value, 0 or 1; None if a sentence chooses none of two.

    A sentence that sets something aside in unknown words chooses none; one that contradicts itself,
    chooses both or takes a choice back gives `OPEN`.
    """
    text = " ".join(words)
    if _TOGETHER.search(text):
        return OPEN
    found = list(_POINTER.finditer(text))
    named = [_index(pointer) for pointer in found]
    known = next((index for index in named if index is not None), None)
    if known is None:
        return OPEN if _REOPENED.search(text) else None
    chosen: set[int] = set()
    for number, (pointer, name) in enumerate(zip(found, named, strict=True)):
        index = 1 - known if name is None else name
        end = found[number + 1].start() if number + 1 < len(found) else len(text)
        before, after = text[: pointer.start()].strip(), text[pointer.end() : end].strip()
        rejected = _is_rejected(before, after)
        since = text[found[number - 1].end() if number else 0 : pointer.start()]
        if not (rejected or _ACCEPTED.search(before)) and _ASIDE.search(since):
            return None
        if rejected and not number and len(list(_ASIDE.finditer(before))) > 1:
            return None
        chosen.add(1 - index if rejected else index)
    return chosen.pop() if len(chosen) == 1 else OPEN


def unread_change(words: Sentence, command: Iterable[Sentence]) -> str | None:
    """Return the words by which a sentence changes what was said; None if it changes nothing.

    Words that set one of two aside count if the command says no value instead.
    """
    text = " ".join(words)
    pointing = any(not _POINTING.isdisjoint(one) for one in command)
    found = _CHANGE.search(text) or (_SKIPPED.search(text) if pointing else None)
    return found[0] if found and read_selection(words) is None else None


def _index(pointer: re.Match[str]) -> int | None:
    """Return 0 or 1; None for *the other*."""
    word = pointer["rank"] or pointer["ordinal"] or pointer["bare"] or pointer["time"]
    return None if word is None else 0 if word in _FIRST else 1


def _is_rejected(before: str, after: str) -> bool:
    """Return whether a pointer is set aside by the words before it, or by those after it."""
    if _REJECTED_AFTER.search(after):
        return True
    return _ACCEPTED.search(before) is None and _REJECTED.search(before) is not None


def with_selection(context: DiscourseContext, sentences: Iterable[Sentence]) -> DiscourseContext:
    """Return a context whose pairs have only the chosen value, or the chosen one first.

    Colors and places keep both, because a command may go on with *the other one*.
    """
    index = None
    for one in sentences:
        last = read_selection(one)
        if last is not None:
            again = index in (None, OPEN, last) or _ANEW.search(" ".join(one))
            index = last if again else OPEN
    if index in (None, OPEN):
        return context
    return context._replace(
        selected=True,
        colors=_reordered(context.colors, index),
        places=_reordered(context.places, index),
        numbers=_narrowed(context.numbers, index),
        positions=_narrowed(context.positions, index),
        moments=_narrowed(context.moments, index),
    )


def unsettled_choice(
    before: DiscourseContext, context: DiscourseContext, sentences: Sequence[Sentence], command: str
) -> str:
    """Return why a choice between two values stays open; empty if it does not.

    Args:
        before: what the sentences introduce.
        context: the same, with the selection.
        sentences: those before the command.
        command: its words.
    """
    pair = before.introduces_pair()
    if context.selected or not {"former", "latter"}.isdisjoint(command.split()):
        for kind in ("colors", "places", "positions"):
            most = max((len(set(getattr(read_remark(one), kind))) for one in sentences), default=0)
            # The latter of a list is its last; but after a pair, a third value is none of it.
            if len(getattr(before, kind)) > max(2, most):
                return "before the command there are more than two values of which to choose one"
    introduced = context.colors or context.places or context.positions or context.moments
    if context.selected and not pair and introduced:
        return "nothing before the command introduces two values of which to choose one"
    named_again = context.preferred_color or context.preferred_moment or context.preferred_position
    if not context.selected and pair and not named_again and CHOSEN.search(command):
        return "nothing before the command says which of two values is meant"
    return ""


def _reordered(pair: tuple[Value, ...], index: int) -> tuple[Value, ...]:
    return pair if len(pair) != 2 else (pair[index], pair[1 - index])  # noqa: PLR2004


def _narrowed(pair: tuple[Value, ...], index: int) -> tuple[Value, ...]:
    return pair if len(pair) != 2 else (pair[index],)  # noqa: PLR2004
