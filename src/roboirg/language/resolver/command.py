"""The command: which things are to be handled, and how often."""

from __future__ import annotations

import functools
import re
from typing import Literal, NamedTuple

from roboirg.episode import COLOURS
from roboirg.language.resolver.places import Place, read_places
from roboirg.language.resolver.tokens import Sentence, number_of, ordinal_of, word_set

_TAKING = word_set("take pick grab grasp lift raise carry move bring fetch get uncover remove hold")
_PUTTING = word_set("put place set lower return drop lay")
_PRESSING = word_set("press push hit tap")
_BEFORE_VERB = word_set(", ; : and then please to finally now after that next afterwards")
_PRONOUNS = word_set("it them")

Kind = Literal["any", "colour", "not", "other", "place", "introduced", "introduced place"]


class Description(NamedTuple):
    """How the command tells one thing that is to be handled.

    Attributes:
        kind: ``any`` says nothing; ``colour`` names it; ``not`` excludes colours; ``other`` is
            the remaining one of some colours; ``place`` names where it is; ``introduced`` and
            ``introduced place`` point at what was named before.
        colours: named colours; empty where the words point at those of the context.
        minus: for ``other``, the colour that it is not; None if the words only point at it.
        place: the named place.
        position: which of the introduced ones, from 0; None if any of them.
    """

    kind: Kind
    colours: tuple[str, ...] = ()
    minus: str | None = None
    place: Place | None = None
    position: int | None = None


class Count(NamedTuple):
    """How often: ``factor * quantity + offset``; without a quantity, the one of the context."""

    factor: float = 1.0
    offset: int = 0
    quantity: int | None = None


class Command(NamedTuple):
    """What a command says."""

    things: tuple[Description, ...]
    times: Count | None


def is_command(words: Sentence) -> bool:
    """Whether the sentence tells somebody to handle something."""
    return any(_is_verb(words, at) for at in range(len(words)))


@functools.lru_cache(maxsize=4096)
def read_command(words: Sentence) -> Command:
    """The things to handle, in order, and how often."""
    clauses = _clauses(words)
    taken = [clause for clause in clauses if clause[0] in _TAKING]
    # "Put the cube on the target" handles a cube too, "put it back" the one in the hand.
    told = taken or [clause for clause in clauses if clause[0] in _PUTTING][:1]
    return Command(tuple(_describe(clause[1:]) for clause in told), _count(words))


def _clauses(words: Sentence) -> list[Sentence]:
    starts = [at for at in range(len(words)) if _is_verb(words, at)]
    ends = [*starts[1:], len(words)]
    return [words[start:end] for start, end in zip(starts, ends, strict=False)]


def _is_verb(words: Sentence, at: int) -> bool:
    if words[at] not in _TAKING | _PUTTING | _PRESSING:
        return False
    return at == 0 or words[at - 1] in _BEFORE_VERB


_THAN = re.compile(
    r"\b(other than|different from|not (in|of|among|one of)|neither|except|apart from|outside)\b"
)
_OTHER_OF = re.compile(r"\bthe other (?:one |colou?r )?(?:of|in|from)\b")
_ONE_NOT = re.compile(
    r"\bthe (?:one|colou?r) (?:of|in|from)\b.*\b(?:not|didn't|isn't|other than|except)\b"
)
_NOT = re.compile(r"\b(?:not|other than|except) (?:in |for )?(red|green|blue)\b")
_FORMER = {"former": 0, "latter": -1}


def _describe(words: Sentence) -> Description:
    text = " ".join(words)
    colours = tuple(word for word in words if word in COLOURS)
    places = read_places(words)
    if places:
        return Description("place", place=places[0])
    if _OTHER_OF.search(text) or _ONE_NOT.search(text):
        return _complement(text, colours)
    if _THAN.search(text):
        return Description("not", colours)
    if colours:
        return Description("colour", colours[:1])
    pointer = _pointer(words)
    if pointer is not None:
        return pointer
    return Description("any")


def _complement(text: str, colours: tuple[str, ...]) -> Description:
    found = _NOT.search(text)
    minus = found[1] if found else None
    among = tuple(dict.fromkeys(colours))
    return Description("other", () if among == (minus,) else among, minus)


def _pointer(words: Sentence) -> Description | None:
    if "there" in words:
        return Description("introduced place")
    for at, word in enumerate(words):
        position = _FORMER.get(word)
        rank = ordinal_of(word)
        if position is None and rank is not None:
            position = rank - 1
        if position is not None:
            is_place = bool({"place", "spot", "position"} & set(words[at + 1 : at + 2]))
            return Description("introduced place" if is_place else "introduced", position=position)
    if _PRONOUNS & set(words) or re.search(r"\bthat (cube|one)\b", " ".join(words)):
        return Description("introduced")
    return None


_QUANTITY = r"(?P<quantity>that|it|this|\w+)(?: times?)?"
_MORE_OR_FEWER = re.compile(
    rf"\b(?P<step>\w+) (?:times? )?(?P<way>more|fewer|less)(?: times?)? than {_QUANTITY}"
)
_AS_MANY = re.compile(
    rf"\b(?P<factor>twice|half|\w+ times) as (?:many times|often|much) as {_QUANTITY}"
)
_THAT_OFTEN = re.compile(r"\b(that|as) (many times|often)\b")
_PLAIN = re.compile(r"\b(?P<number>\w+) times?\b")
_ADVERBS = {"once": 1, "twice": 2, "thrice": 3}
_FACTORS = {"twice": 2.0, "half": 0.5}


def _count(words: Sentence) -> Count | None:
    text = " ".join(words)
    found = _MORE_OR_FEWER.search(text)
    if found and (step := number_of(found["step"])) is not None:
        sign = 1 if found["way"] == "more" else -1
        return Count(offset=sign * step, quantity=number_of(found["quantity"]))
    found = _AS_MANY.search(text)
    if found:
        factor = _FACTORS.get(found["factor"]) or number_of(found["factor"].split()[0])
        return Count(factor=float(factor or 1), quantity=number_of(found["quantity"]))
    if _THAT_OFTEN.search(text):
        return Count()
    for adverb, number in _ADVERBS.items():
        if adverb in words:
            return Count(quantity=number)
    for plain in _PLAIN.finditer(text):
        number_told = number_of(plain["number"])
        if number_told is not None:
            return Count(quantity=number_told)
    return None
