"""The command: which sentences it is, and the words for the things that are to be handled."""

from __future__ import annotations

import functools
from typing import NamedTuple

from roboirg.language.interpreter.descriptions import Description, describe
from roboirg.language.interpreter.quantities import CountExpression, Quantity, quantities
from roboirg.language.interpreter.tokens import Sentence, colors_in, word_set

_TAKING = word_set(
    "take pick grab grasp lift raise carry move bring fetch get uncover remove hold swing"
)
_PUTTING = word_set("put place set lower return drop lay throw toss")
_PRESSING = word_set("press push hit tap stop halt make let")
_BEFORE_VERB = word_set(", ; : and then please to finally now after that next afterwards but first")
_INTO = word_set("into inside in")
_BARE_PRONOUNS = word_set("it them that")
_SINGULAR = word_set("it cube one")


class Item(NamedTuple):
    """So many things of one sort; without a number, nothing tells how many."""

    number: CountExpression | None
    thing: Description


class Command(NamedTuple):
    """What a command says.

    Attributes:
        text: all its words.
        handled: the words for each thing that is handled, in order; each thing once.
        added: the words for things of other colors that are only said to be put somewhere.
        entered: the words for each thing that something is put into.
    """

    text: str
    handled: tuple[Sentence, ...]
    added: tuple[Sentence, ...] = ()
    entered: tuple[Sentence, ...] = ()

    @property
    def things(self) -> tuple[Description, ...]:
        """What is told about the things one by one."""
        return tuple(describe(words) for words in self.handled)

    @property
    def boxes(self) -> tuple[Description, ...]:
        """What is told about the things that something is put into."""
        return tuple(describe(words) for words in self.entered)

    @property
    def items(self) -> tuple[Item, ...]:
        """What is told about the things with their numbers."""
        return tuple(item for words in (*self.handled, *self.added) for item in _items(words))


def is_command(words: Sentence) -> bool:
    """Whether the sentence tells somebody to handle something."""
    return any(_is_verb(words, at) for at in range(len(words)))


@functools.lru_cache(maxsize=4096)
def read_command(words: Sentence) -> Command:
    """The commanding sentences, and the things to handle."""
    clauses = _clauses(words)
    taken = [clause for clause in clauses if clause[0] in _TAKING]
    put = [clause for clause in clauses if clause[0] in _PUTTING]
    # "Put the cube on the target" handles a cube too, "put it back" the one in the hand.
    told = taken or put
    fresh = [clause for clause in told if clause is told[0] or not _goes_on(clause)]
    known = {color for clause in taken for color in colors_in(clause)}
    added = [clause for clause in put if taken and set(colors_in(clause)) - known]
    return Command(
        " ".join(words),
        tuple(clause[1:] for clause in fresh),
        tuple(clause[1:] for clause in added),
        tuple(found for clause in clauses if (found := _entered(clause))),
    )


def _entered(clause: Sentence) -> Sentence:
    """``it`` of ``put the tape into it``; empty if nothing is put into anything."""
    if clause[0] not in _TAKING | _PUTTING:
        return ()
    at = next((at for at, word in enumerate(clause) if word in _INTO), len(clause))
    return clause[at + 1 :]


def _goes_on(clause: Sentence) -> bool:
    """Whether it only says what to do with the thing at hand: ``carry it over``."""
    objects = [word for word in clause[1:3] if word not in ("up", "down", "back")]
    return not objects or objects[0] in _BARE_PRONOUNS


def _clauses(words: Sentence) -> list[Sentence]:
    starts = [at for at in range(len(words)) if _is_verb(words, at)]
    ends = [*starts[1:], len(words)]
    return [words[start:end] for start, end in zip(starts, ends, strict=False)]


def _is_verb(words: Sentence, at: int) -> bool:
    if words[at] not in _TAKING | _PUTTING | _PRESSING:
        return False
    return at == 0 or words[at - 1] in _BEFORE_VERB


def _items(words: Sentence) -> tuple[Item, ...]:
    """``two red cubes and one that is blue``: each quantity begins the words for one sort."""
    text = " ".join(words)
    found = [one for one in quantities(text) if _counts_things(one, text)]
    if not found:
        alone = "them" not in words and not _SINGULAR.isdisjoint(words)
        return (Item(CountExpression(quantity=1) if alone else None, describe(words)),)
    ends = [*(one.start for one in found[1:]), len(text)]
    return tuple(
        Item(one.told, describe(_words_of(text, one, end)))
        for one, end in zip(found, ends, strict=True)
    )


def _counts_things(one: Quantity, text: str) -> bool:
    return not one.plain or text[one.start : one.end] not in ("once", "twice", "thrice")


def _words_of(text: str, one: Quantity, end: int) -> Sentence:
    # A derived quantity has its color inside: "one fewer red cube than that".
    return tuple(text[one.start : end].split())
