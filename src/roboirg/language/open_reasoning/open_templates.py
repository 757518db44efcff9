"""Wordings of open reasoning, in which no single word of the context or the command is the key.

The pools say the same in different constructions: steps to follow against a description of the
result, for example.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from roboirg.core.word_pools import Pools

EXCLUDED_COLORS = Pools(
    train=(
        "I dislike {color}.",
        "I am tired of {color}.",
        "{color} is dull.",
        "I have too much {color}.",
        "I do not like {color}.",
        "My sister hates {color}.",
        "We never use {color}.",
        "{color} is not for me.",
        "We have had enough of {color}.",
        "{color} looks ugly.",
    ),
    test=(
        "{color} bores me.",
        "I do not care for {color}.",
        "{color} is out of fashion.",
        "I never wear {color}.",
        "{color} looks boring.",
        "I cannot stand {color}.",
        "{color} reminds me of school.",
        "My brother hates {color}.",
        "I have seen enough {color}.",
        "Everyone dislikes {color}.",
    ),
)
ANOTHER_COLOR = Pools(
    train=("another color", "a different color", "some other color", "a new color"),
    test=("any other color", "a color other than that", "any different color", "some new color"),
)
"""Next to one excluded color, where two of them are left but only one is there."""
REMAINING = Pools(
    train=("Look at {others}.", "I like {others}.", "Think of {others}.", "Let's use {others}."),
    test=(
        "That leaves {others}.",
        "I prefer {others}.",
        "{others} are fine.",
        "{others} are better.",
    ),
)
"""Names the two things that are left, of which the command compares where they stand."""


class Comparative(NamedTuple):
    """Words for one of two things, by where they stand.

    Attributes:
        axis: of the robot base frame, 0 for x (away from the robot) or 1 for y (to its left).
        sign: +1 if the thing meant has the larger coordinate.
        words: follow the noun.
    """

    axis: int
    sign: int
    words: str


COMPARATIVES = Pools(
    train=(
        Comparative(0, -1, "nearer to you"),
        Comparative(0, 1, "farther from you"),
        Comparative(1, 1, "farther to your left"),
        Comparative(1, -1, "farther to your right"),
    ),
    test=(
        Comparative(0, -1, "closer to you"),
        Comparative(0, 1, "further from you"),
        Comparative(1, 1, "further to your left"),
        Comparative(1, -1, "further to your right"),
    ),
)

COMBINATIONS: Mapping[str, Pools[str]] = {
    "total": Pools(train=("add {numbers} up",), test=("the sum of {numbers}",)),
    "difference": Pools(
        train=("take the difference between {numbers}",), test=("the difference between {numbers}",)
    ),
    "larger": Pools(train=("take the larger of {numbers}",), test=("the higher of {numbers}",)),
    "smaller": Pools(train=("take the smaller of {numbers}",), test=("the lower of {numbers}",)),
}
"""The first step of a calculation."""
NUMBERS = Pools(
    train=("those numbers", "these numbers", "the numbers", "those"),
    test=("them", "these", "the values", "these values"),
)
CALCULATIONS = Pools(
    train=("{steps}.", "Now {steps}.", "Let's {steps}.", "Please {steps}."),
    test=(
        "My number is {steps}.",
        "The number is {steps}.",
        "The number I want is {steps}.",
        "I want {steps}.",
    ),
)
"""Before the command, which asks for *that many*."""


class SecondStep(NamedTuple):
    """The second step of a calculation.

    Attributes:
        name: for records; the number in it is in the words, too, whatever the result.
        words: by pool, around the words for the first step, ``{first}``.
        offset: the result is ``factor * first + offset``.
        factor: see `offset`.
    """

    name: str
    words: Pools[str]
    offset: int = 0
    factor: float = 1.0

    def result(self, first: int) -> int | None:
        """Return what follows from the result of the first step; None if it is no number."""
        found = self.factor * first + self.offset
        return int(found) if found >= 1 and found.is_integer() else None


def _step(name: str, train: str, test: str, offset: int = 0, factor: float = 1.0) -> SecondStep:
    return SecondStep(name, Pools((train,), (test,)), offset, factor)


SECOND_STEPS = (
    _step("itself", "{first}", "{first}"),
    _step("one less", "{first} and subtract one", "one less than {first}", -1),
    _step("one more", "{first} and add one", "one more than {first}", 1),
    _step("two less", "{first} and subtract two", "two less than {first}", -2),
    _step("two more", "{first} and add two", "two more than {first}", 2),
    _step("three less", "{first} and subtract three", "three less than {first}", -3),
    _step("four less", "{first} and subtract four", "four less than {first}", -4),
    _step("five less", "{first} and subtract five", "five less than {first}", -5),
    _step("half", "{first} and halve it", "half of {first}", factor=0.5),
    _step("double", "{first} and double it", "double {first}", factor=2.0),
)
THAT_MANY = Pools(train=("that many times",), test=("that number of times",))

WHO = Pools(
    train=("My sister", "My aunt", "My daughter", "Grandma", "Mom"),
    test=("My brother", "My uncle", "My son", "Grandpa", "Dad"),
)
PREFERENCES = (
    Pools(
        train=(
            "{who} likes the moment {yes} more than the one {no}.",
            "{who} would not trade the moment {yes} for the one {no}.",
        ),
        test=(
            "{who} finds the moment {yes} better than the one {no}.",
            "{who} would not swap the moment {yes} for the one {no}.",
        ),
    ),
    Pools(
        train=(
            "{who} likes the moment {no} less than the one {yes}.",
            "{who} would trade the moment {no} for the one {yes}.",
        ),
        test=(
            "{who} finds the moment {no} worse than the one {yes}.",
            "{who} would swap the moment {no} for the one {yes}.",
        ),
    ),
)
"""Two moments, the favorite one named first, or last; the same words lead to both."""
FAVORITES = Pools(
    train=(
        "at the moment she would pick",
        "at the moment she would not skip",
        "at the moment she would choose",
        "at the moment she would not give up",
    ),
    test=(
        "at the moment he would keep",
        "at the moment he would not drop",
        "at the moment he would prefer",
        "at the moment he would not trade away",
    ),
)
NOT_FAVORITES = Pools(
    train=(
        "at the moment she would skip",
        "at the moment she would not pick",
        "at the moment she would give up",
        "at the moment she would not choose",
    ),
    test=(
        "at the moment he would drop",
        "at the moment he would not keep",
        "at the moment he would trade away",
        "at the moment he would not prefer",
    ),
)
"""As often with *not* as the favorite ones, and of the same verbs."""
