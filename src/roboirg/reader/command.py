"""Commands: which sentences give them, and the words for the things to handle."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from roboirg.reader.descriptions import Description, describe
from roboirg.reader.quantities import ADVERBS, CountExpression, Quantity, quantities
from roboirg.reader.tokens import Sentence, colors_in, word_set
from roboirg.reader.vocabulary import PUTTING, TAKING, VERBS

BEFORE_VERB = word_set(
    ", ; : and then to finally now after that next afterwards but first repeatedly"
)
_REQUESTS = frozenset(
    pair
    for modal in ("can", "could", "will", "would", "must", "should")
    for pair in ((modal, "you"), ("you", modal))
)
"""Pairs of words before a verb that make a sentence a command."""
_INTO = word_set("into inside in")
_BARE_PRONOUNS = word_set("it them that")
_PARTICLES = word_set("up down back")
_SINGULAR = word_set("it cube one")
_JOINTS = word_set(", ; and then finally afterwards next")
_JOINED = word_set("container box one former latter first second third other")


class Item(NamedTuple):
    """A number of things of one color; the number is None if the command gives none."""

    number: CountExpression | None
    thing: Description


class Command(NamedTuple):
    """The parts of a command.

    Attributes:
        text: all its words.
        handled: the words for each thing to handle, in order; each thing once.
        added: the words for things of other colors that only a verb of putting names.
        entered: the words for each thing that something is put into.
    """

    text: str
    handled: tuple[Sentence, ...]
    added: tuple[Sentence, ...] = ()
    entered: tuple[Sentence, ...] = ()

    @property
    def things(self) -> tuple[Description, ...]:
        """The descriptions of the things to handle."""
        return tuple(describe(words) for words in self.handled)

    @property
    def things_in_order(self) -> tuple[Description, ...]:
        """The same, with a description for each of the things that one verb handles in turn."""
        found: list[Description] = []
        for words in (part for clause in self.handled for part in _parts(clause)):
            thing, colors = describe(words), tuple(dict.fromkeys(colors_in(words)))
            several = thing.kind == "color" and len(colors) > 1
            found += [thing._replace(colors=(one,)) for one in colors] if several else [thing]
        return tuple(found)

    @property
    def boxes(self) -> tuple[Description, ...]:
        """The descriptions of the things that something is put into."""
        return tuple(describe(words) for words in self.entered)

    @property
    def items(self) -> tuple[Item, ...]:
        """The descriptions of the things to handle, with their numbers."""
        return tuple(item for words in (*self.handled, *self.added) for item in _items(words))


def is_command(words: Sentence) -> bool:
    """Return whether a sentence contains a known verb in the place of a command's verb."""
    return any(_is_verb(words, at) for at in range(len(words)))


@functools.lru_cache(maxsize=4096)
def read_command(words: Sentence) -> Command:
    """Read the words of all commanding sentences as one command."""
    clauses = _clauses(words)
    taken = [clause for clause in clauses if clause[0] in TAKING and not _shares(clause)]
    put = [clause for clause in clauses if clause[0] in PUTTING]
    return Command(
        " ".join(words),
        # "Put the cube on the target" handles a cube too, "put it back" the one in the hand.
        _first_mentions(taken or put),
        _other_colors(put, taken) if taken else (),
        tuple(found for clause in clauses if (found := _entered(clause))),
    )


def _first_mentions(clauses: Sequence[Sentence]) -> tuple[Sentence, ...]:
    """Return the words after each verb, unless they continue with the thing in the hand."""
    return tuple(clause[1:] for clause in clauses if clause is clauses[0] or not _continues(clause))


def _other_colors(put: Sequence[Sentence], taken: Sequence[Sentence]) -> tuple[Sentence, ...]:
    """Return the words for things that are put somewhere, of colors that are not taken."""
    known = {color for clause in taken for color in colors_in(clause)}
    return tuple(clause[1:] for clause in put if set(colors_in(clause)) - known)


def _entered(clause: Sentence) -> Sentence:
    """Return ``it`` of ``put the tape into it``; empty if nothing is put into anything."""
    if clause[0] not in TAKING | PUTTING:
        return ()
    at = next((at for at, word in enumerate(clause) if word in _INTO), len(clause))
    return clause[at + 1 :]


def _continues(clause: Sentence) -> bool:
    """Return whether a clause goes on with the thing in the hand: ``carry it over``."""
    objects = [word for word in clause[1:3] if word not in _PARTICLES]
    return not objects or objects[0] in _BARE_PRONOUNS


def _shares(clause: Sentence) -> bool:
    """Return whether a verb has its object after the next verb: ``pick and place the cube``."""
    return len(clause) > 1 and clause[-1] == "and" and set(clause[1:-1]) <= _PARTICLES


def _clauses(words: Sentence) -> list[Sentence]:
    starts = [at for at in range(len(words)) if _is_verb(words, at)]
    ends = [*starts[1:], len(words)]
    return [words[start:end] for start, end in zip(starts, ends, strict=False)]


def _is_verb(words: Sentence, at: int) -> bool:
    if words[at] not in VERBS:
        return False
    if at == 0 or words[at - 1] in BEFORE_VERB or words[max(0, at - 2) : at] in _REQUESTS:
        return True
    return words[at - 1] in ("you", "do") and words[max(0, at - 2) : at - 1] in ((), (",",))


def _parts(words: Sentence) -> Iterator[Sentence]:
    """Yield the parts of ``the container at the left, and then the one at the right``."""
    start = 0
    for at in range(1, len(words) - 1):
        joined = words[at - 1] in _JOINTS or words[max(0, at - 2) : at] == ("after", "that")
        if joined and words[at] == "the" and words[at + 1] in _JOINED:
            yield words[start:at]
            start = at
    yield words[start:]


def _items(words: Sentence) -> tuple[Item, ...]:
    """Split ``two red cubes and one that is blue``: each quantity begins a new item."""
    text = " ".join(words)
    found = [quantity for quantity in quantities(text) if _counts_things(quantity, text)]
    if not found:
        alone = "them" not in words and not _SINGULAR.isdisjoint(words)
        return (Item(CountExpression(quantity=1) if alone else None, describe(words)),)
    ends = [*(quantity.start for quantity in found[1:]), len(text)]
    # A derived quantity has its color inside: "one fewer red cube than that".
    return tuple(
        Item(quantity.expression, describe(tuple(text[quantity.start : end].split())))
        for quantity, end in zip(found, ends, strict=True)
    )


def _counts_things(quantity: Quantity, text: str) -> bool:
    return not quantity.plain or text[quantity.start : quantity.end] not in ADVERBS
