"""Wordings of the grounded setting: what is counted, what happened, and where things stand.

The pools differ in constructions: *the nearest neighbor of the cube closest to you* in one, *the
cube right next to the one closest to you* in the other.
"""

from __future__ import annotations

from typing import NamedTuple

from roboirg.core.word_pools import Pools


class Standing(NamedTuple):
    """How the words for a thing say when it stands where it does.

    Attributes:
        started: precedes a place, for things that move before the words are heard.
        now: follows a place, for things that move afterwards.
    """

    started: str = ""
    now: str = ""


STANDS = Standing()
STANDS_NOW = Standing(now=" now")
STOOD = Standing(started="that started ")

MIDDLE = Pools(
    train=("the middle {noun}{now} from {way}", "the {noun} {started}in the middle from {way}"),
    test=(
        "the {noun} that comes in the middle{now} from {way}",
        "the {noun} {started}as the middle one from {way}",
    ),
)
"""In the middle of a row: for what stands there, and for what stood there."""
WAYS = {"y": "left to right", "x": "near to far"}
"""By axis of the robot base frame."""
_NEIGHBOR = Pools(
    train=(
        "the nearest neighbor of the {noun} {anchor}{now}",
        "the {noun} {started}nearest to the one {anchor}",
    ),
    test=(
        "the {noun} right next to the one {anchor}{now}",
        "the {noun} {started}right next to the one {anchor}",
    ),
)
_SECOND_NEIGHBOR = Pools(
    train=(
        "the second nearest neighbor of the {noun} {anchor}{now}",
        "the {noun} {started}second nearest to the one {anchor}",
    ),
    test=(
        "the {noun} that is second nearest to the one {anchor}{now}",
        "the {noun} that was second nearest at first to the one {anchor}",
    ),
)
NEIGHBORS = (_NEIGHBOR, _SECOND_NEIGHBOR)
"""The nearest one to another one, which has a place of its own; and the second nearest."""
LEFT_OVER = Pools(
    train=("the {noun} {started_or_is}neither {first} nor {second}",),
    test=("the only {noun} {started_or_is}not {first} or {second}",),
)
"""Of three things, the one that is left without two; for a command that says it all."""
LEFT_OVER_SAID = Pools(
    train=(
        "Ignore the {noun} {started}{first}{now} and the one {started}{second}. I want {{which}}.",
        "Ignore the {noun} {started}{first}{now} and the one {started}{second}. I need {{which}}.",
    ),
    test=(
        "Forget the {noun} {started}{first}{now} and the one {started}{second}. I chose {{which}}.",
        "Forget the {noun} {started}{first}{now} and the one {started}{second}. I meant {{which}}.",
    ),
)
"""The same in an introduction, in two sentences."""
LEFT = Pools(train=("the one that is left",), test=("the remaining one",))
"""What remains then."""
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
    train=("the cube that was moved in the video", "the cube from the video"),
    test=("the cube that was carried in the video", "the cube that the video showed"),
)


class CountedWords(NamedTuple):
    """Words for a number that is to be counted.

    Attributes:
        words: for a command that says it all.
        counted: what is counted, in an introduction.
    """

    words: str
    counted: str


SWAPS = Pools(
    train=(
        CountedWords(
            "once for every time that cubes changed places",
            "how often cubes changed places in the video",
        ),
    ),
    test=(
        CountedWords(
            "as many times as there were swaps in the video",
            "how many swaps there were in the video",
        ),
    ),
)
BESIDE = Pools(
    train=(
        CountedWords(
            "once for every {cube} now {side} than the cube in the video",
            "the {cube}s that are now {side} than the cube from the video",
        ),
        CountedWords(
            "once for the cube in the video and once for every {cube} now {side} than it is",
            "the {cube}s that are now {side} than the cube from the video, and add one",
        ),
    ),
    test=(
        CountedWords(
            "as many times as there are {cube}s now {side} than the lifted one",
            "how many {cube}s are now {side} than the lifted one",
        ),
        CountedWords(
            "as many times as there are {cube}s now {side} than the lifted one, and once more",
            "how many {cube}s are now {side} than the lifted one, plus one",
        ),
    ),
)
"""As many as the cubes on one side of the cube in the video, and one more than that."""
COUNTED = Pools(
    train=("Count {times}.", "First count {times}.", "Please count {times}.", "Now count {times}."),
    test=("Note {times}.", "Think {times}.", "Look {times}.", "See {times}."),
)
"""An introduction: what is to be counted before the command."""
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
    """Words for a number of cubes.

    Attributes:
        before: precedes *of the red cubes*.
        after: follows it.
    """

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
    Pools(train=("the next to last placement",), test=("the second to last placement",)),
)
"""The last placement, and the one before it."""
BEFORE_PRESS = Pools(
    train=("the placement right before the button press",),
    test=("the placement that the button press followed",),
)
PLACEMENT_AT = Pools(train=("the placement {anchor}",), test=("the placement made {anchor}",))
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
PLACEMENT_INTRODUCTIONS = Pools(
    train=(
        "I liked {which}.",
        "I am thinking of {which}.",
        "Think back to {which}.",
        "In the video I noticed {which}.",
        "What matters in the video is {which}.",
        "Look closely at {which}.",
    ),
    test=(
        "Remember {which}.",
        "I was watching {which}.",
        "In the video I liked {which}.",
        "What counts in the video is {which}.",
        "You saw {which}.",
        "I mean {which}.",
    ),
)
