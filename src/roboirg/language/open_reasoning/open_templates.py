"""Wordings of open reasoning, in which no single word of the context or the command is the key."""

from __future__ import annotations

from typing import NamedTuple

from roboirg.core.word_pools import Pools

EXCLUDED_COLORS = Pools(
    train=(
        "I dislike {color}.",
        "I am tired of {color}.",
        "{color} is dull.",
        "I have too much {color}.",
    ),
    test=(
        "{color} bores me.",
        "I avoid {color}.",
        "{color} is out of fashion.",
        "I never wear {color}.",
    ),
)
ANOTHER_COLOR = Pools(
    train=("another color", "a different color", "some other color", "a new color"),
    test=("any other color", "a distinct color", "an alternative color", "a separate color"),
)
"""Next to one excluded color; two of them are left."""


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

TWO_QUANTITIES = Pools(
    train=(
        "I drew {first} and {second}.",
        "Ann said {first}, Bob said {second}.",
        "The dice show {first} and {second}.",
        "My scores are {first} and {second}.",
    ),
    test=(
        "The cards say {first} and {second}.",
        "Tom wrote {first}, Ella wrote {second}.",
        "We counted {first} and {second}.",
        "My results were {first} and {second}.",
    ),
)
TOTALS = Pools(
    train=("the total", "their total", "that total", "the combined total"),
    test=("the sum", "their sum", "that sum", "the combined sum"),
)
DIFFERENCES = Pools(
    train=("the difference", "their difference", "that difference", "the difference between them"),
    test=("the gap", "their gap", "that gap", "the gap between them"),
)


class TwoStepRelation(NamedTuple):
    """The relation of a number to a total or a difference.

    Attributes:
        name: for records.
        times: words for a number of repetitions.
        cubes: words for a number of cubes of a color.
        value: words for a number.
        offset: the result is ``factor * reference + offset``.
        factor: see `offset`.
    """

    name: str
    times: str
    cubes: str
    value: str
    offset: int = 0
    factor: float = 1.0

    def reference(self, result: int) -> int | None:
        """Return the total or difference from which a result follows; None if it is no whole."""
        reference = (result - self.offset) / self.factor
        return int(reference) if reference.is_integer() else None


TWO_STEP_RELATIONS = (
    TwoStepRelation(
        "one fewer",
        "one time fewer than {number}",
        "one fewer {color} cube than {number}",
        "one less than {number}",
        offset=-1,
    ),
    TwoStepRelation(
        "one more",
        "one more time than {number}",
        "one more {color} cube than {number}",
        "one more than {number}",
        offset=1,
    ),
    TwoStepRelation(
        "two fewer",
        "two fewer times than {number}",
        "two fewer {color} cubes than {number}",
        "two less than {number}",
        offset=-2,
    ),
    TwoStepRelation(
        "half",
        "half as many times as {number}",
        "half as many {color} cubes as {number}",
        "half of {number}",
        factor=0.5,
    ),
    TwoStepRelation(
        "twice",
        "twice as many times as {number}",
        "twice as many {color} cubes as {number}",
        "twice {number}",
        factor=2.0,
    ),
)
"""Relations that most numbers allow; *two more* would tell that the result is at least three."""

PREFERENCES = (
    Pools(
        train=(
            "My sister prefers the moment {yes} to the one {no}.",
            "My sister likes the moment {yes} more than the one {no}.",
        ),
        test=(
            "My brother likes the moment {yes} better than the one {no}.",
            "My brother chose the moment {yes} over the one {no}.",
        ),
    ),
    Pools(
        train=(
            "My sister would trade the moment {no} for the one {yes}.",
            "My sister gave up the moment {no} for the one {yes}.",
        ),
        test=(
            "My brother swapped the moment {no} for the one {yes}.",
            "My brother would skip the moment {no} for the one {yes}.",
        ),
    ),
)
"""Two moments, the favorite one named first, or last."""
FAVORITES = Pools(
    train=(
        "at her preferred moment",
        "at the moment she prefers",
        "at the moment she would choose",
        "at the moment of her choice",
    ),
    test=(
        "at his favorite moment",
        "at the moment he would keep",
        "at the moment he would pick",
        "at the moment of his choice",
    ),
)
NOT_FAVORITES = Pools(
    train=(
        "at the moment she would skip",
        "at the moment she did not choose",
        "at the moment she does not prefer",
        "at the moment she gave up",
    ),
    test=(
        "at the moment he would give up",
        "at the moment he would not keep",
        "at the moment he would not pick",
        "at the moment he did not keep",
    ),
)
