"""Clues: what there is to see that leads to one value of the goal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

from roboirg.language.request import InstructionRequest

ClueKind = Literal["counts", "events", "from the end", "bridging", "betweenness", "sets", "place"]


class Clue(NamedTuple):
    """Words for a value that only who sees the scene or the video can tell.

    Attributes:
        kind: what has to be seen.
        words: for the thing, the number or the placement.
        after: words that follow *of the red cubes*, for a number of cubes.
        said: the sentence or sentences of the introduction with ``{which}``; empty for any.
        short: the words for ``{which}`` there.
        of_handled: whether the words stand for the thing to handle, not for its cube.
        aside: the places of the other two of three things, if these are what the words say.
    """

    kind: ClueKind
    words: str
    after: str = ""
    said: str = ""
    short: str = ""
    of_handled: bool = False
    aside: tuple[str, ...] = ()


def draw_clue(request: InstructionRequest, purpose: str, clues: Sequence[Clue]) -> Clue | None:
    """Draw the kind first, then one of its clues; None if there is none."""
    kinds = list(dict.fromkeys(one.kind for one in clues))
    if not kinds:
        return None
    kind = request.sampler.pick(f"{purpose} clue", kinds)
    return request.sampler.pick(purpose, [one for one in clues if one.kind == kind])
