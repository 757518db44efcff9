"""Placements in the video: from its end, about the press, and by where a target lies."""

from __future__ import annotations

from collections.abc import Iterator

from roboirg.core.episode import SceneObject
from roboirg.core.motions import Swap
from roboirg.language.grounded import grounded_templates as templates
from roboirg.language.grounded.clue import Clue
from roboirg.language.grounded.things import directed
from roboirg.language.landmarks import Ranking, nearness
from roboirg.language.request import GoalValue, InstructionRequest

KEPT = {2: (2, 6), 3: (3, 6), 4: (4, 6)}
"""Share of the videos with two to four placements that count from the end.

A placement of a short series is more often the goal than one of a long one; with these shares
*the last* and *the last but one* are each of three placements equally often.
"""


def placements(request: InstructionRequest) -> list[SceneObject]:
    """Return the targets on which the video shows the cube placed, in order."""
    scene = request.episode.scene
    shown = [scene[str(fact.place)] for fact in scene.past if fact.kind == "placed"]
    return [item for item in shown if item.kind == "target"]


def placement_clues(request: InstructionRequest, value: GoalValue) -> list[Clue]:
    """Return the clues to the placement that the goal asks for."""
    shown, order = placements(request), value.slot == "placement"
    place = value.number - 1 if order else ("before", "after").index(str(value.value))
    found = [*_at(request, shown, place), *_moved(request, shown, place)]
    if order:
        # Of two placements, the last one would always be that after the press.
        found += [*_from_the_end(request, len(shown), place), *_before_press(request, place)]
    return found


def _at(request: InstructionRequest, shown: list[SceneObject], place: int) -> Iterator[Clue]:
    """Yield words for where the target lies among those on which the cube was placed."""
    rankings = [
        (words, Ranking(directed(axis, sign))) for (axis, sign), words in templates.EXTREMES.items()
    ]
    (button,) = request.episode.scene.of_kind("button")
    rankings.append(("closest to the button", nearness(button.position)))
    for anchor, ranking in rankings:
        if ranking.select(shown, 0) is shown[place]:
            for words in templates.PLACEMENT_AT.of(request.pool):
                yield Clue("bridging", words.format(anchor=anchor))


def _moved(request: InstructionRequest, shown: list[SceneObject], place: int) -> Iterator[Clue]:
    """Yield words for the only target of the series that changes places in the end, or does not."""
    swaps = request.episode.scene.motions_of(Swap)
    moved = {name for swap in swaps for name in (swap.first, swap.second)}
    for kind, wanted in (("moved", True), ("still", False)):
        if moved and [item for item in shown if (item.name in moved) is wanted] == [shown[place]]:
            for words in templates.PLACEMENT_MOVED[kind].of(request.pool):
                yield Clue("events", words)


def _from_the_end(request: InstructionRequest, length: int, place: int) -> Iterator[Clue]:
    kept, of = KEPT[length]
    back = length - 1 - place
    if back < len(templates.FROM_THE_END) and (
        request.sampler.pick("kept from the end", range(of)) < kept
    ):
        for words in templates.FROM_THE_END[back].of(request.pool):
            yield Clue("from the end", words)


def _before_press(request: InstructionRequest, place: int) -> Iterator[Clue]:
    pressed = [fact.kind for fact in request.episode.scene.past].index("pressed")
    if pressed == place + 1:
        for words in templates.BEFORE_PRESS.of(request.pool):
            yield Clue("events", words)
