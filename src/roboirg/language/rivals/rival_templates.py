"""Wordings for two values on equal terms, and for the choice of one of them.

A remark that chooses has a field for the value that is meant, ``{yes}``, and for the one that is
not, ``{no}``. Within a kind and a pool as many remarks name the one first as the other, and equally
many of both have *not* or *no*: then no single word, and no first or last pointer, tells which of
the two is meant.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

from roboirg.core.word_pools import Pools

THING_PAIRS = Pools(
    train=("I like {pair}.", "I see {pair}.", "Here are {pair}.", "I painted {pair}."),
    test=("I know {pair}.", "I noticed {pair}.", "There are {pair}.", "{pair} are nice."),
)
NUMBER_PAIRS = Pools(
    train=(
        "{pair} are my numbers.",
        "I like the numbers {pair}.",
        "I thought of {pair}.",
        "The dice show {pair}.",
    ),
    test=(
        "I drew the numbers {pair}.",
        "{pair} are good numbers.",
        "The cards say {pair}.",
        "I read {pair}.",
    ),
)
ELEMENT_PAIRS = Pools(
    train=("I like {pair}.", "We talked about {pair}.", "I know {pair}.", "{pair} are nice."),
    test=("I noted {pair}.", "{pair} are special.", "I care about {pair}.", "Think of {pair}."),
)
"""For visits and placements."""
MOMENT_PAIRS = Pools(
    train=(
        "I like the moments {pair}.",
        "I know the moments {pair}.",
        "We talked about the moments {pair}.",
        "The moments {pair} are nice.",
    ),
    test=(
        "I noted the moments {pair}.",
        "The moments {pair} are special.",
        "I care about the moments {pair}.",
        "Think of the moments {pair}.",
    ),
)
PAIR_REINFORCEMENTS = Pools(
    train=(
        "I often think of {ref}.",
        "{ref} make me smile.",
        "I know {ref} well.",
        "I am fond of {ref}.",
    ),
    test=(
        "{ref} mean a lot to me.",
        "I keep thinking of {ref}.",
        "{ref} please me.",
        "I am happy with {ref}.",
    ),
)
"""One more remark about both values."""


class Pointers(NamedTuple):
    """Words that point at the first and at the second of two introduced values.

    Attributes:
        first: for one thing.
        second: for one thing.
        first_many: for several things.
        second_many: for several things.
    """

    first: str
    second: str
    first_many: str = ""
    second_many: str = ""


RANKS = Pointers("the former", "the latter", "the former", "the latter")
"""For every kind of value; both pools have them, as there are no other such words."""
MENTIONED = Pools(
    train=(
        Pointers(
            "the first one I mentioned",
            "the last one I mentioned",
            "the first ones I mentioned",
            "the last ones I mentioned",
        ),
        Pointers(
            "the one I mentioned earlier",
            "the one I mentioned later",
            "the ones I mentioned earlier",
            "the ones I mentioned later",
        ),
    ),
    test=(
        Pointers(
            "the first one I named",
            "the last one I named",
            "the first ones I named",
            "the last ones I named",
        ),
        Pointers(
            "the one I named earlier",
            "the one I named later",
            "the ones I named earlier",
            "the ones I named later",
        ),
    ),
)
"""For things only: next to numbers and ordinals *first* and *one* would name a value."""

ReferenceKind = Literal["alone", "set aside", "preference", "contrast", "correction"]

SINGLED = Pools(
    train=("I mean {yes}.", "I want {yes}.", "Why not {yes}?", "I cannot do without {yes}."),
    test=(
        "I have chosen {yes}.",
        "My choice is {yes}.",
        "I would not trade {yes}.",
        "I would not give up {yes}.",
    ),
)
SET_ASIDE = Pools(
    train=("I leave out {no}.", "I have set {no} aside.", "Not {no}.", "I do not mean {no}."),
    test=(
        "Forget about {no}.",
        "I have ruled out {no}.",
        "It is not {no}.",
        "I did not choose {no}.",
    ),
)
CHOICES: dict[ReferenceKind, tuple[Pools[str], Pools[str]]] = {
    "preference": (
        Pools(
            train=("I prefer {yes} to {no}.", "I favor {yes} over {no}."),
            test=("I like {yes} better than {no}.", "I chose {yes} over {no}."),
        ),
        Pools(
            train=("I gave up {no} for {yes}.", "Instead of {no}, I want {yes}."),
            test=("I swapped {no} for {yes}.", "Rather than {no}, I chose {yes}."),
        ),
    ),
    "contrast": (
        Pools(
            train=("I mean {yes}, not {no}.", "I want {yes} and not {no}."),
            test=("It is {yes}, not {no}.", "My choice is {yes} and not {no}."),
        ),
        Pools(
            train=("I did not mean {no} but {yes}.", "I do not want {no} but {yes}."),
            test=("It is not {no} but {yes}.", "My choice is not {no} but {yes}."),
        ),
    ),
    "correction": (
        Pools(
            train=("I mean {yes} and by no means {no}.", "I want {yes}, no longer {no}."),
            test=("It is {yes} and in no case {no}.", "My choice is {yes}, no longer {no}."),
        ),
        Pools(
            train=("I mean {no} - no, {yes}.", "I want {no}; no, {yes}."),
            test=("It is {no} - no, {yes}.", "My choice is {no}; no, {yes}."),
        ),
    ),
}
"""Remarks with both fields: those with the meant value first, and those with it last."""

CLAUSES = Pools(
    train=("I mean", "I want", "I asked for", "I favor"),
    test=("I chose", "I prefer", "I selected", "I opted for"),
)
"""Follow the noun in the command: *the cube I mean*."""
NUMBERS_OF = Pools(
    train=("my number", "my own number", "my chosen number", "my favorite number"),
    test=("my preferred number", "my final number", "my special number", "my given number"),
)
"""For a number of cubes: *my number of the red cubes*."""
