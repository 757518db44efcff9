"""Words of the reasoning setting: what the context names, and how the goal follows from it."""

from __future__ import annotations

from typing import NamedTuple

from roboirg.core.word_pools import Pools

EXCLUDED_INTRODUCTIONS = Pools(
    train=(
        "I am tired of {colors}.",
        "I do not like {colors}.",
        "We have had enough of {colors}.",
        "We never use {colors}.",
    ),
    test=(
        "{colors} [bores|bore] me.",
        "I do not care for {colors}.",
        "I never wear {colors}.",
        "I cannot stand {colors}.",
    ),
)
SHARED_INTRODUCTIONS = Pools(
    train=(
        "We talked about {colors}.",
        "My kids like {colors}.",
        "Ben and Ann like {colors}.",
        "Everyone wants {colors}.",
    ),
    test=(
        "My friends like {colors}.",
        "Mom likes {colors}.",
        "Tom wants {colors}.",
        "My kids want {colors}.",
    ),
)
"""For two colors of which one is handled, too: dislikes would contradict that."""
SINGLED_INTRODUCTIONS = Pools(
    train=("My sister took {single}.", "Dad picked {single}.", "Grandma got {single}."),
    test=("My son chose {single}.", "My aunt took {single}.", "My friend got {single}."),
)


class Exclusion(NamedTuple):
    """Words for a thing that has none of the named colors.

    Attributes:
        frame: the thing, with the field ``{excluded}``.
        words: for that field; they point back at the colors.
        resolved: the same with the colors, ``{colors}``.
    """

    frame: str
    words: str
    resolved: str


EXCLUSIONS = Pools(
    train=(
        Exclusion("{thing}[|s] that [is|are] {excluded}", "neither of those", "neither {colors}"),
        Exclusion("{thing}[|s] that [is|are] {excluded}", "neither of them", "neither {colors}"),
        Exclusion(
            "{thing}[|s] that [is|are] {excluded}", "neither of those colors", "neither {colors}"
        ),
        Exclusion("{thing}[|s] whose color is {excluded}", "not in that pair", "neither {colors}"),
    ),
    test=(
        Exclusion("{thing}[|s] that [is|are] {excluded}", "neither of these", "neither {colors}"),
        Exclusion("{thing}[|s] that [is|are] {excluded}", "neither of the two", "neither {colors}"),
        Exclusion(
            "{thing}[|s] in a color {excluded}", "not in that pair", "that is neither {colors}"
        ),
    ),
)
"""For two colors."""
_DIFFERENT = ("different from that", "different from {colors}")
_OTHER_THAN = ("other than that", "other than {colors}")
SINGLE_EXCLUSIONS = Pools(
    train=(
        Exclusion("{thing}[|s] whose color is {excluded}", *_DIFFERENT),
        Exclusion("{thing}[|s] of a color {excluded}", *_OTHER_THAN),
    ),
    test=(
        Exclusion("{thing}[|s] in a color {excluded}", *_DIFFERENT),
        Exclusion("{thing}[|s] in a color {excluded}", *_OTHER_THAN),
    ),
)
COMPLEMENT = "the {thing} in {other}"
"""For the second pick: of the two excluded colors, the one that was not chosen."""
AMOUNT_COMPLEMENT = "{thing}[|s] in {other}"

TAKEN_REMARKS = Pools(
    train=("My brother chose {single}.", "My sister wants {single}.", "Last time it was {single}."),
    test=("My friend chose {single}.", "My uncle wants {single}.", "Yesterday it was {single}."),
)
"""Said of the one of two values that is not meant."""
OTHERS = {
    "color": Pools(
        train=("the other {noun}", "the other one"),
        test=("the other of the two {nouns}", "the remaining {noun}"),
    ),
    "amount": Pools(train=("of the other {noun}",), test=("of the others",)),
    "number": Pools(train=("the other number of times",), test=("the other number of times",)),
    "count": Pools(train=("the other number",), test=("the other number",)),
    "visit": Pools(
        train=("the other {noun}",),
        test=("the remaining {noun}",),
    ),
    "placement": Pools(
        train=("the other {noun}",),
        test=("the remaining {noun}",),
    ),
}
"""The value that is left, by kind of words."""
RESOLVED_OTHERS = {
    "color": "the {noun} in {both} but not {left}",
    "amount": "{noun} in {both} but not {left}",
    "count": "{both} but not {left}",
    "number": "{both} times but not {left}",
    "visit": "the {both} {noun} but not the {left}",
    "placement": "the {both} {noun} but not the {left}",
}

MOMENTS = {"before": "right before the button press", "after": "right after the button press"}
MOMENT_ANAPHORS = ("at that moment", "then")
BOTH_MOMENTS = "right before and right after the button press"
TWO_MOMENTS_INTRODUCTIONS = Pools(
    train=(
        "Of the moments {pair}, my sister prefers {single}.",
        "Between the moments {pair}, Dad chose {single}.",
        "Of the moments {pair}, my brother liked {single} better.",
    ),
    test=(
        "Of the times {pair}, my uncle would choose {single}.",
        "Between the times {pair}, my sister chose {single}.",
        "Of the placements {pair}, Mom picked {single}.",
    ),
)
NEIGHBOR_INTRODUCTIONS = Pools(
    train=(
        "Think of the placement {moment}.",
        "My sister liked the placement {moment}.",
        "I am thinking of the placement {moment}.",
    ),
    test=(
        "Remember the placement {moment}.",
        "My brother liked the placement {moment}.",
        "You saw the placement {moment}.",
    ),
)
MOMENT_COMPLEMENT = "at the other moment"
RESOLVED_MOMENT_COMPLEMENT = "at the other moment, not {single}"
NEIGHBOR = "the placement closest in time to {single}"
"""Of two placements, each is the other's neighbor; *earlier* would give it away."""


class Relation(NamedTuple):
    """The relation of a number to a reference quantity.

    Attributes:
        name: for records.
        times: words for a number of repetitions.
        cubes: words for a number of cubes of a color.
        each: words for numbers of cubes of several colors, with ``{number}`` for *each*.
        offset: the result is ``factor * reference + offset``.
        factor: see `offset`.
        spells: the number that the words contain; they would give away a result of this value.
    """

    name: str
    times: str
    cubes: str
    each: str
    offset: int = 0
    factor: float = 1.0
    spells: int | None = None

    @property
    def than(self) -> str:
        """The word before what a number is compared with."""
        return "as" if self.offset == 0 else "than"

    def reference(self, result: int) -> int | None:
        """Return the quantity to introduce; None if it is no whole number."""
        reference = (result - self.offset) / self.factor
        return int(reference) if reference.is_integer() else None


MAX_REFERENCE = 10
"""The largest quantity to introduce."""

RELATIONS = (
    Relation(
        "one fewer",
        "one time fewer than {number}",
        "one fewer {color} cube than {number}",
        "one fewer {number}",
        offset=-1,
        spells=1,
    ),
    Relation(
        "one more",
        "one more time than {number}",
        "one more {color} cube than {number}",
        "one more {number}",
        offset=1,
        spells=1,
    ),
    Relation(
        "two fewer",
        "two fewer times than {number}",
        "two fewer {color} cubes than {number}",
        "two fewer {number}",
        offset=-2,
        spells=2,
    ),
    Relation(
        "two more",
        "two more times than {number}",
        "two more {color} cubes than {number}",
        "two more {number}",
        offset=2,
        spells=2,
    ),
    Relation(
        "twice",
        "twice as often as {number}",
        "twice as many {color} cubes as {number}",
        "twice as many {number}",
        factor=2.0,
        spells=2,
    ),
    Relation(
        "half",
        "half as often as {number}",
        "half as many {color} cubes as {number}",
        "half as many {number}",
        factor=0.5,
    ),
)


class Step(NamedTuple):
    """The relation of an element of a series to a reference element.

    Attributes:
        name: for records.
        words: words after the noun.
        offset: from the reference to the result.
        spells: as in `Relation`.
    """

    name: str
    words: str
    offset: int
    spells: int | None = None


STEPS = (
    Step("right after", "right after {reference}", 1),
    Step("right before", "right before {reference}", -1),
    Step("two after", "two after {reference}", 2, spells=2),
    Step("two before", "two before {reference}", -2, spells=2),
)
NEIGHBORS = {
    1: Step("neighbor", "closest in time to {reference}", -1),
    2: Step("neighbor", "closest in time to {reference}", 1),
}
"""The steps in a series of two elements, by position."""
COUNTED_STEPS = (
    Step("one earlier", "one {noun} earlier than {reference}", -1, spells=1),
    Step("one later", "one {noun} later than {reference}", 1, spells=1),
    Step("two earlier", "two {noun}s earlier than {reference}", -2, spells=2),
    Step("two later", "two {noun}s later than {reference}", 2, spells=2),
)
"""The same as numbers: *one visit earlier than that*."""
