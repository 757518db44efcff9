"""Wordings for two values on equal terms, and for the choice of one of them.

A remark that chooses has a field for the value that is meant, ``{yes}``, and for the one that is
not, ``{no}``. Within a kind and a pool as many remarks name the one first as the other, and equally
many of both have *not* or *no*: then no single word, and no first or last pointer, shows which of
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
        "I am thinking of {things}.",
        "Dad bought {things}.",
        "Grandma likes {things}.",
        "My sister has {things}.",
        "Mom bought {things}.",
        "My kids painted {things}.",
        "{things} look good.",
        "{things} were presents.",
    ),
    test=(
        "I thought about {things}.",
        "Dad made {things}.",
        "I spotted {things}.",
        "{things} caught my eye.",
        "{things} are nice.",
        "My son likes {things}.",
        "Our guests liked {things}.",
        "I bought {things}.",
        "Mom gave me {things}.",
        "My niece likes {things}.",
        "Uncle Tom found {things}.",
        "I considered {things}.",
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
        "{things} seem good.",
        "My kids picked {things}.",
        "I am thinking of {things}.",
        "Ann suggested {things}.",
    ),
    test=(
        "I considered {things}.",
        "Tom asked about {things}.",
        "{things} are possible.",
        "Think of {things}.",
        "Grandpa mentioned {things}.",
        "I have in mind {things}.",
    ),
)
"""For visits and placements."""
MOMENT_PAIRS = Pools(
    train=(
        "Think of the moments {things}.",
        "We talked about the moments {things}.",
        "I am thinking of the moments {things}.",
        "My kids liked the moments {things}.",
    ),
    test=(
        "I considered the moments {things}.",
        "The moments {things} are possible.",
        "Remember the moments {things}.",
        "I have in mind the moments {things}.",
    ),
)


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
ORDER = Pointers("the first one", "the second one", "the first ones", "the second ones")
"""For things, which have no ordinals of their own."""
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
        "I want {yes}.",
        "Let's use {yes}.",
    ),
    test=(
        "I have chosen {yes}.",
        "I will go with {yes}.",
        "I decided on {yes}.",
        "My choice is {yes}.",
    ),
)
SET_ASIDE = Pools(
    train=(
        "Let's leave out {no}.",
        "I am done with {no}.",
        "Let's skip {no}.",
        "Forget about {no}.",
    ),
    test=(
        "I can do without {no}.",
        "I have ruled out {no}.",
        "I decided against {no}.",
        "Never mind {no}.",
    ),
)
CHOICES: dict[ReferenceKind, tuple[Pools[str], Pools[str]]] = {
    "preference": (
        Pools(
            train=("I prefer {yes} to {no}.", "I like {yes} better than {no}."),
            test=("I chose {yes} over {no}.", "I picked {yes} instead of {no}."),
        ),
        Pools(
            train=("Instead of {no}, I want {yes}.", "Let's leave out {no} and use {yes}."),
            test=("I considered {no} but chose {yes}.", "Rather than {no}, I picked {yes}."),
        ),
    ),
    "contrast": (
        Pools(
            train=("I mean {yes}, not {no}.", "I want {yes}, not {no}."),
            test=("I chose {yes} and not {no}.", "I picked {yes} and did not pick {no}."),
        ),
        Pools(
            train=("I do not mean {no}, I mean {yes}.", "I do not want {no}, I want {yes}."),
            test=("It is not {no}, it is {yes}.", "Not {no}, I chose {yes}."),
        ),
    ),
    "correction": (
        Pools(
            train=(
                "I actually mean {yes} instead of {no}.",
                "Actually, I want {yes} instead of {no}.",
            ),
            test=("I now prefer {yes} to {no}.", "I finally chose {yes} over {no}."),
        ),
        Pools(
            train=("I mean {no} - sorry, {yes}.", "Let's use {no} - or rather {yes}."),
            test=("I switched from {no} to {yes}.", "I considered {no} and then chose {yes}."),
        ),
    ),
}
"""Remarks with both fields: those with the meant value first, and those with it last.

*Sorry* and *or rather* are in training alone, *from X to Y* and *X over Y* are for tests.
"""

CLAUSES = Pools(
    train=("I mean", "I want", "I prefer", "I need"),
    test=("I chose", "I picked", "I have chosen", "I have picked"),
)
"""Follow the noun in the command: *the cube I mean*."""
NUMBERS_OF = Pools(
    train=(
        "the right number of",
        "the agreed number of",
        "the desired number of",
        "my number of",
    ),
    test=(
        "the chosen number of",
        "the correct number of",
        "the final number of",
        "the selected number of",
    ),
)
"""For a number of cubes: *the right number of red cubes*."""
