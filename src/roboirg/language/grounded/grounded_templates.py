"""Wordings of the grounded setting: what is counted, what happened, and where things stand.

The pools differ in constructions: *nearest to the cube closest to you* in one, *the nearest
neighbor of the cube closest to you* in the other.
"""

from __future__ import annotations

from typing import NamedTuple

from roboirg.core.word_pools import Pools


class Standing(NamedTuple):
    """How the words for a thing say when it stands where it does.

    Attributes:
        be: begins the clause of a place.
        adverb: the same before a phrase that needs no clause.
        have: begins the clause of what is around it.
    """

    be: str
    adverb: str
    have: str


STANDS = Standing("that is ", "", "that has ")
STANDS_NOW = Standing("that is now ", "now ", "that now has ")
STOOD = Standing("that initially was ", "initially ", "that initially had ")

MIDDLES = {
    "y": Pools(
        train=("the {noun} {adverb}in the middle from left to right",),
        test=("the {noun} {have}as many {noun}s to its left as to its right",),
    ),
    "x": Pools(
        train=("the {noun} {adverb}in the middle from near to far",),
        test=("the {noun} {have}as many {noun}s in front of it as behind it",),
    ),
}
"""In the middle of a row, from left to right (y) or from near to far (x)."""
NEIGHBORS = (
    Pools(
        train=("the {noun} {adverb}nearest to the one {anchor}",),
        test=("the {noun} {be}nearest to the one {anchor}",),
    ),
    Pools(
        train=("the {noun} {adverb}second nearest to the one {anchor}",),
        test=("the {noun} {be}second nearest to the one {anchor}",),
    ),
)
"""The nearest one to another one, which has a place of its own; and the second nearest."""
LEFT_OVER = Pools(
    train=("the {noun} {be}neither {first} nor {second}",),
    test=("the only {noun} {be}not {first} or {second}",),
)
"""Of three things, the one that is left without two."""
_STILL = Pools(train=("the container that never {moved}",), test=("the container that {stayed}",))
_MOST = Pools(
    train=("the container that {moved} most often",),
    test=("the container that {moved} more often than the rest",),
)
MOVES = {"still": _STILL, "most": _MOST}
"""Containers by how often they change places: never, or more often than every other one."""
SHOWN = {"moved": "moved", "stayed": "stayed where it was"}
COMING = {"moved": "moves", "stayed": "stays where it is"}
"""The verbs, for moves in the video and for those to come."""
CARRIED = Pools(
    train=("the cube that was moved in the video", "the cube that the video is about"),
    test=("the cube that the robot carried in the video", "the cube that the robot held"),
)

SWAPS = Pools(
    train=("once for every time that cubes changed places",),
    test=("as many times as there were swaps in the video",),
)
BESIDE = Pools(
    train=(
        "once for every {cube} now {side} than the cube in the video",
        "once for the cube in the video and once for every {cube} now {side} than it is",
    ),
    test=(
        "as many times as there are {cube}s now {side} than the lifted one",
        "as many times as there are {cube}s now {side} than the lifted one, and once more",
    ),
)
"""As many as the cubes on one side of the cube in the video, and one more than that."""
SIDES = {
    ("y", 1): "farther to your left",
    ("y", -1): "farther to your right",
    ("x", -1): "closer to you",
    ("x", 1): "farther from you",
}
"""By axis of the robot base frame and sign."""
EXTREMES = {**SIDES, ("x", -1): "closest to you", ("x", 1): "farthest from you",
            ("y", 1): "farthest to your left", ("y", -1): "farthest to your right"}  # fmt: skip


class AmountWords(NamedTuple):
    """Words for a number of cubes: what precedes *of the red cubes*, and what follows it."""

    before: str
    after: str = ""


ALL_BUT = Pools(
    train=(AmountWords("all but three"),),
    test=(AmountWords("all", "except for three"),),
)
AMOUNTS_BESIDE = Pools(
    train=(AmountWords("as many", "as there are {side} than the {fixture}"),),
    test=(AmountWords("the same number", "as you see {side} than the {fixture}"),),
)

FROM_THE_END = (
    Pools(train=("the last placement",), test=("the final placement",)),
    Pools(train=("the last placement but one",), test=("the second to last placement",)),
)
"""The last placement, and the one before it."""
BEFORE_PRESS = Pools(
    train=("the placement right before the button press",),
    test=("the placement that the button press followed",),
)
PLACEMENT_AT = Pools(
    train=("the placement {anchor}",), test=("the placement that was made {anchor}",)
)
PLACEMENT_MOVED = {
    "moved": Pools(
        train=("the placement whose target moved in the end",),
        test=("the placement whose target later changed places",),
    ),
    "still": Pools(
        train=("the placement whose target never moved",),
        test=("the placement whose target stayed where it was",),
    ),
}
NUMBER_INTRODUCTIONS = Pools(
    train=(
        "I want this done {times}.",
        "We will do this {times}.",
        "This should happen {times}.",
        "I would do it {times}.",
    ),
    test=(
        "This has to be done {times}.",
        "I would like it done {times}.",
        "We need to do this {times}.",
        "It must happen {times}.",
    ),
)
"""For what is counted: *the bell rang once for every swap* would be a riddle."""
PLACEMENT_INTRODUCTIONS = Pools(
    train=(
        "I liked {which}.",
        "I keep thinking about {which}.",
        "I often think of {which}.",
        "The video had one part that I liked: {which}.",
        "What I liked in the video was {which}.",
        "I was pleased with {which}.",
    ),
    test=(
        "My favorite was {which}.",
        "I well remember {which}.",
        "What impressed me in the video was {which}.",
        "I was impressed by {which}.",
        "I have not forgotten {which}.",
        "{which} was the best part of the video.",
    ),
)
