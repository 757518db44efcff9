"""Numbers to be counted in the scene or in the video.

What is counted is drawn without a look at the goal; it is said if it is the goal's number. Each
draw fits every number of the scene equally often, so that the words say nothing about it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from roboirg.core.episode import SceneObject
from roboirg.core.instruction_options import DEFAULT_LANGUAGE
from roboirg.core.motions import Swap
from roboirg.language.grounded import grounded_templates as templates
from roboirg.language.grounded.clue import Clue
from roboirg.language.grounded.things import AXES, directed, late
from roboirg.language.landmarks import MARGIN
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.tasks.shared.swapping import places_at_last

KEPT_SWAPS = {1: (1, 2), 2: (1, 3), 3: (1, 1)}
"""Share of the scenes with this number of swaps that say it, so that all are equally frequent.

Of easy scenes half have one swap and half two, of medium ones half two and half three; two of four
episodes are easy, one is medium.
"""
LEFT = 3
"""Cubes that *all but three* leaves: BinFill's easy scenes allow it for every number."""


def repeat_clues(request: InstructionRequest, number: GoalValue) -> list[Clue]:
    """Return the clue to a number of repetitions, if the episode has one."""
    scene = request.episode.scene
    if not scene.past or scene.past[0].kind != "picked":
        return []
    draws = [
        ("swaps", "", ""),
        *(("beside", axis, color) for axis in AXES for color in _colors(request)),
    ]
    order = request.sampler.cycle("counted", draws)
    for _ in draws:
        kind, axis, color = next(order)
        clue = _swaps(request, number) if kind == "swaps" else _beside(request, number, axis, color)
        if clue is not None:
            return [clue]
    return []


def _colors(request: InstructionRequest) -> tuple[str, ...]:
    return tuple(dict.fromkeys(str(item.color) for item in request.episode.scene.of_kind("cube")))


def _swaps(request: InstructionRequest, number: GoalValue) -> Clue | None:
    swaps = len(request.episode.scene.motions_of(Swap))
    kept, of = KEPT_SWAPS.get(swaps, (0, 1))
    if swaps != number.number or request.sampler.pick("kept swaps", range(of)) >= kept:
        return None
    said = request.pick("swap words", templates.SWAPS)
    return Clue("events", said.words, short=said.counted)


def _beside(request: InstructionRequest, number: GoalValue, axis: str, color: str) -> Clue | None:
    """Return words that count the cubes on one side of the cube in the video."""
    scene, purpose = request.episode.scene, f"{axis}-{color}"
    sign = request.sampler.pick(f"side-{purpose}", (1, -1))
    cubes = [_at_last(request, item) for item in scene.of_kind("cube") if item.color == color]
    (shown,) = (
        _at_last(request, item) for item in scene.objects if item.name == scene.past[0].subject
    )
    # The cube itself counts where all are alike, so that each of one to three is possible.
    alike = len(_colors(request)) == 1
    added = 1 if alike else request.sampler.pick(f"itself-{purpose}", (0, 1))
    if alike and not _in_clear_order(cubes, axis):
        return None
    counted = count_beside([one for one in cubes if one.name != shown.name], shown, axis, sign)
    if counted is None or counted + added != number.number:
        return None
    noun = "cube" if alike else f"{color} cube"
    said = templates.BESIDE.of(request.pool)[added]
    words, short = (one.format(cube=noun, side=templates.SIDES[axis, sign]) for one in said)
    return Clue("counts", words, short=short)


def _at_last(request: InstructionRequest, item: SceneObject) -> SceneObject:
    """Return a thing where it is after the last swap."""
    place = places_at_last(request.episode.scene)[item.name]
    return SceneObject(item.name, item.kind, place, color=item.color)


def count_beside(
    things: Sequence[SceneObject], reference: SceneObject, axis: str, sign: int
) -> int | None:
    """Return how many things are on one side of another; None if that is unclear for one."""
    along = directed(axis, sign)
    away = [along(item) - along(reference) for item in things]
    if any(abs(one) < MARGIN for one in away):
        return None
    return sum(one > 0 for one in away)


def _in_clear_order(things: Sequence[SceneObject], axis: str) -> bool:
    """Return whether all are clear from each other; else a middle one is clear more rarely."""
    places = sorted(map(directed(axis, 1), things))
    return all(after - before >= MARGIN for before, after in itertools.pairwise(places))


def amount_clues(request: InstructionRequest, count: GoalValue) -> list[Clue]:
    """Return the clue to BinFill's only number of cubes, if the scene has a single color.

    Where there are several, large numbers go with certain words.
    """
    scene, color = request.episode.scene, request.color_values[0]
    if late(scene) or len(request.scene_colors) > 1:
        return []
    cubes = request.objects_to_point_at(color)
    # Along x, bin and button lie at the ends of the cubes' region: nearly all are on one side.
    draws = ["all but", "y bin", "y button"]
    if request.options.language != DEFAULT_LANGUAGE:
        draws = ["all but"]
    order = request.sampler.cycle("counted", draws)
    for draw in itertools.islice(order, len(draws)):
        axis, _, fixture = draw.partition(" ")
        if axis == "all":
            if len(cubes) - count.number == LEFT:
                words = request.pick("all but", templates.ALL_BUT)
                return [Clue("counts", *words)]
            continue
        sign = request.sampler.pick(f"side-{axis}-{fixture}", (1, -1))
        if count_beside(cubes, scene[fixture], axis, sign) == count.number:
            words = request.pick("amount beside", templates.AMOUNTS_BESIDE)
            side = templates.SIDES[axis, sign]
            return [Clue("counts", words.before, words.after.format(side=side, fixture=fixture))]
    return []
