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
        adjective: the same before an adjectival phrase, which needs no clause.
        have: begins the clause of what is around it.
        end: follows the place.
    """

    be: str
    adjective: str
    have: str
    end: str = ""


STANDS = Standing("that is ", "", "that has ")
STANDS_NOW = Standing("that is now ", "now ", "that now has ")
STOOD = Standing("that was ", "that was ", "that had ", " at first")

MIDDLES = {
    "y": Pools(
        train=("{adjective}in the middle from left to right{end}",),
        test=("{have}the same number of {noun}s on its left and on its right{end}",),
    ),
    "x": Pools(
        train=("{adjective}in the middle from near to far{end}",),
        test=("{have}the same number of {noun}s in front of it and behind it{end}",),
    ),
}
"""In the middle of a row, from left to right (y) or from near to far (x)."""
NEIGHBORS = Pools(
    train=("{adjective}nearest to the {noun} {anchor}{end}",),
    test=("{be}the nearest neighbor of the {noun} {anchor}{end}",),
)
"""The nearest one to another one, which has a place of its own."""
LEFT_OVER = Pools(
    train=("{be}neither {first} nor {second}{end}",),
    test=("other than the one {adjective}{first} and the one {adjective}{second}{end}",),
)
"""Of three things, the one that is left without two."""
OTHER_COLOR = Pools(
    train=("of a color other than that of the cube {anchor}",),
    test=("that differ in color from the cube {anchor}",),
)
"""Of cubes in two colors, those of the other one."""

SHOWN_MOVES = {
    "still": Pools(train=("that never moved",), test=("that stayed where it was",)),
    "most": Pools(train=("that moved most often",), test=("that moved more often than the rest",)),
}
COMING_MOVES = {
    "still": Pools(train=("that never moves",), test=("that stays where it is",)),
    "most": Pools(train=("that moves most often",), test=("that moves more often than the rest",)),
}
"""Containers by how often they change places: never, or more often than every other one."""
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
        "once for the cube in the video and once for every {cube} now {side} than it",
    ),
    test=(
        "as many times as there are {cube}s now {side} than the lifted one",
        "one time more than there are {cube}s now {side} than the lifted one",
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
    test=(AmountWords("one", "for each that lies {side} than the {fixture}"),),
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
    train=("the placement {anchor}",), test=("the placement on the target {anchor}",)
)
PLACEMENT_MOVED = {
    "moved": Pools(
        train=("the placement on the target that moved in the end",),
        test=("the placement on the target that later changed places",),
    ),
    "still": Pools(
        train=("the placement on the target that never moved",),
        test=("the placement on the target that stayed where it was",),
    ),
}
