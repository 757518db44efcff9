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
    train=(
        "Here are {things}.",
        "I see {things}.",
        "I painted {things}.",
        "We talked about {things}.",
        "My kids love {things}.",
        "We have {things}.",
        "Ben brought {things}.",
        "You can see {things}.",
        "Dad bought {things}.",
        "Grandma likes {things}.",
        "My sister has {things}.",
        "Mom bought {things}.",
        "Everyone can see {things}.",
        "{things} look good.",
        "{things} were presents.",
    ),
    test=(
        "I noticed {things}.",
        "Dad made {things}.",
        "I spotted {things}.",
        "{things} caught my eye.",
        "{things} are nice.",
        "My son likes {things}.",
        "Our guests liked {things}.",
        "I bought {things}.",
        "Mom gave me {things}.",
        "This is about {things}.",
        "Uncle Tom found {things}.",
        "Consider {things}.",
    ),
)
NUMBER_PAIRS = Pools(
    train=(
        "I rolled {things}.",
        "I thought of {things}.",
        "The dice show {things}.",
        "Dad said {things}.",
        "We got {things}.",
        "My scores were {things}.",
        "{things} are my lucky numbers.",
        "{things} came up.",
        "My kids picked {things}.",
        "Ann wrote down {things}.",
    ),
    test=(
        "I drew {things}.",
        "The cards say {things}.",
        "My results were {things}.",
        "Ella wrote {things}.",
        "{things} won the raffle.",
        "{things} are on my tickets.",
        "Grandpa guessed {things}.",
        "The twins chose {things}.",
        "Tom noted {things}.",
    ),
)
ELEMENT_PAIRS = Pools(
    train=(
        "I like {things}.",
        "We talked about {things}.",
        "{things} are special.",
        "My kids picked {things}.",
        "I am thinking of {things}.",
        "Ann wrote down {things}.",
    ),
    test=(
        "I noted {things}.",
        "I care about {things}.",
        "{things} matter to me.",
        "Think of {things}.",
        "Grandpa mentioned {things}.",
        "This is about {things}.",
    ),
)
"""For visits and placements."""
MOMENT_PAIRS = Pools(
    train=(
        "I liked the moments {things}.",
        "We talked about the moments {things}.",
        "I remember the moments {things}.",
        "My kids loved the moments {things}.",
    ),
    test=(
        "I enjoyed the moments {things}.",
        "The moments {things} were special.",
        "I keep thinking of the moments {things}.",
        "This is about the moments {things}.",
    ),
)
PAIR_REINFORCEMENTS = Pools(
    train=("I like {ref}.", "{ref} are great.", "I enjoy {ref}.", "{ref} are useful."),
    test=("{ref} are fine.", "I love {ref}.", "{ref} look good.", "I remember {ref}."),
)
"""One more remark about both values; short, as two remarks and a command come with it."""


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
            "the one I mentioned first",
            "the one I mentioned last",
            "the ones I mentioned first",
            "the ones I mentioned last",
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
            "the one I named first",
            "the one I named last",
            "the ones I named first",
            "the ones I named last",
        ),
    ),
)
"""For things only: next to numbers and ordinals *first* and *one* would name a value."""

ReferenceKind = Literal["alone", "set aside", "preference", "contrast", "correction"]

SINGLED = Pools(
    train=(
        "I mean {yes}.",
        "I would like {yes}.",
        "I would not skip {yes}.",
        "I would not refuse {yes}.",
    ),
    test=(
        "I have chosen {yes}.",
        "I will go with {yes}.",
        "I would not mind {yes}.",
        "I would not pass up {yes}.",
    ),
)
SET_ASIDE = Pools(
    train=(
        "Let's leave out {no}.",
        "I am done with {no}.",
        "I do not mean {no}.",
        "I do not want {no}.",
    ),
    test=(
        "Forget about {no}.",
        "I have ruled out {no}.",
        "I do not need {no}.",
        "I did not choose {no}.",
    ),
)
CHOICES: dict[ReferenceKind, tuple[Pools[str], Pools[str]]] = {
    "preference": (
        Pools(
            train=("I prefer {yes} to {no}.", "I like {yes} better than {no}."),
            test=("I chose {yes} over {no}.", "I picked {yes} rather than {no}."),
        ),
        Pools(
            train=("Instead of {no}, I want {yes}.", "I would leave out {no} and choose {yes}."),
            test=("I passed up {no} for {yes}.", "Rather than {no}, I picked {yes}."),
        ),
    ),
    "contrast": (
        Pools(
            train=("I mean {yes}, not {no}.", "I want {yes} and not {no}."),
            test=("It is {yes} that I want, not {no}.", "I want {yes}, definitely not {no}."),
        ),
        Pools(
            train=("I do not mean {no} but {yes}.", "I do not want {no} but {yes}."),
            test=("I do not want {no}, I want {yes}.", "Definitely not {no}, I want {yes}."),
        ),
    ),
    "correction": (
        Pools(
            train=("I now want {yes}, no longer {no}.", "I now mean {yes}, no longer {no}."),
            test=("I now want {yes} instead of {no}.", "I switched to {yes} from {no}."),
        ),
        Pools(
            train=("I mean {no} - no, {yes}.", "Let's take {no} - no, {yes}."),
            test=("I switched from {no} to {yes}.", "I gave up {no} for {yes}."),
        ),
    ),
}
"""Remarks with both fields: those with the meant value first, and those with it last.

*Not X but Y* and a *no* that takes back are in training alone; the others are for tests.
"""

CLAUSES = Pools(
    train=("I mean", "I want", "I asked for", "I need"),
    test=("I chose", "I prefer", "I picked", "I selected"),
)
"""Follow the noun in the command: *the cube I mean*."""
NUMBERS_OF = Pools(
    train=(
        "the right number of",
        "the chosen number of",
        "the desired number of",
        "the agreed number of",
    ),
    test=(
        "the correct number of",
        "the selected number of",
        "the preferred number of",
        "the final number of",
    ),
)
"""For a number of cubes: *the right number of red cubes*."""
