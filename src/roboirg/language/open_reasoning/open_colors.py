"""Open color exclusion: one color is excluded, and the scene shows which of two others is meant."""

from __future__ import annotations

from roboirg.core.motions import Swap
from roboirg.language.instruction import REFERENCE
from roboirg.language.landmarks import MARGIN
from roboirg.language.number_words import plural
from roboirg.language.open_reasoning import open_templates as templates
from roboirg.language.patterns.pattern import Derived, Pattern
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, plain
from roboirg.language.request import InstructionRequest
from roboirg.language.slot_types import amount, described

TWO, THREE = 2, 3


def _present(request: InstructionRequest) -> tuple[str, ...]:
    """Return the colors of the things that the task may choose among, each once."""
    thing = request.task.commands.colored
    kinds = (thing, f"hidden_{thing}")
    found = (item.color for item in request.episode.scene.objects if item.kind in kinds)
    return tuple(dict.fromkeys(str(color) for color in found if color is not None))


# One color of two: what is left is one of the two other colors, and only the scene shows which.


def _allows_amount(request: InstructionRequest) -> bool:
    if not request.values_of("amount") or len(request.color_values) != 1:
        return False
    (color,), colors = request.color_values, _present(request)
    wanted = request.count_of(color)
    enough = all(
        len(request.objects_to_point_at(color._replace(value=one))) >= wanted for one in colors
    )
    return len(colors) == TWO and enough


def _exclude_amount(request: InstructionRequest) -> Derived:
    (color,) = request.color_values
    (excluded,) = (one for one in _present(request) if one != color.value)
    words = _another(request, excluded, many=request.count_of(color) > 1)
    notes = {"patterns": ["color exclusion"]}
    return Derived(_context(request, excluded), described(request, [words]), notes)


# One color of three: of the two things left, the words compare where they stand.


def _excluded(request: InstructionRequest) -> tuple[str, str] | None:
    """Return the excluded color, and the one that is left next to the goal's; None if not three."""
    colors, goal = _present(request), [one.color for one in request.color_values]
    if not request.values_of("color") or len(colors) != THREE or request.shows_color:
        return None
    others = [one for one in colors if one not in goal]
    if len(goal) == TWO:
        return others[0], goal[1]
    excluded = request.sampler.pick("excluded color", sorted(others))
    return excluded, next(one for one in others if one != excluded)


def _comparatives(request: InstructionRequest, left: str) -> list[templates.Comparative]:
    """Return the words that tell the goal's thing from the one of another color."""
    meant = request.color_values[0]
    places = [
        request.objects_to_point_at(meant._replace(value=color))[0].position
        for color in (meant.value, left)
    ]
    return [
        one
        for one in templates.COMPARATIVES.of(request.pool)
        if (places[0][one.axis] - places[1][one.axis]) * one.sign >= MARGIN
    ]


def _allows_place(request: InstructionRequest) -> bool:
    found = _excluded(request)
    return found is not None and bool(_comparatives(request, found[1]))


def _exclude_by_place(request: InstructionRequest) -> Derived:
    found = _excluded(request)
    assert found is not None  # noqa: S101 - `_allows_place`
    excluded, left = found
    possible = _comparatives(request, left)
    if request.task.commands.names_sides:
        # "Further to your left from your right" is hard to hear.
        possible = [one for one in possible if one.axis == 0] or possible
    chosen = request.sampler.pick("comparative", possible)
    opposite = next(
        one
        for one in templates.COMPARATIVES.of(request.pool)
        if (one.axis, one.sign) == (chosen.axis, -chosen.sign)
    )
    things = [
        request.by_color(color, plain(f"the one {_standing(request, words)}"))
        for color, words in zip(request.color_values, (chosen, opposite), strict=False)
    ]
    first = request.color_values[0]
    notes = {
        "patterns": ["color exclusion"],
        "relation": chosen.words,
        "candidates": {first.slot: sorted((first.color, left))},
    }
    context, remark = _context(request, excluded), _remaining(request, excluded)
    return Derived(context, described(request, things), notes, remark)


def _standing(request: InstructionRequest, words: templates.Comparative) -> str:
    """Return the comparison, with its time where things change places."""
    if any(isinstance(motion, Swap) for motion in request.episode.scene.motions):
        return f"that started {words.words}"
    return words.words


def _context(request: InstructionRequest, excluded: str) -> Phrase:
    template = request.pick("excluded introduction", templates.EXCLUDED_COLORS)
    return fill(template, {"color": antecedent(excluded, REFERENCE, excluded)})


def _remaining(request: InstructionRequest, excluded: str) -> Phrase:
    """Return a remark on the two things that are left."""
    things = plural(request.task.commands.colored)
    words, named = f"the other two {things}", f"the two {things} that are not {excluded}"
    others = request.refer(words, "other", REFERENCE, excluded, resolved=named)
    return fill(request.pick("remaining", templates.REMAINING), {"others": others})


def _another(request: InstructionRequest, excluded: str, *, many: bool) -> Phrase:
    """Return ``cubes of another color``."""
    another = (
        antecedent(f"a color other than {excluded}", REFERENCE, excluded)
        if request.resolved
        else anaphor(
            request.pick("another color", templates.ANOTHER_COLOR), "other", REFERENCE, excluded
        )
    )
    return (*plain(f"{amount.noun(2 if many else 1)} of "), *another)


ONE_OF_TWO = Pattern(_allows_amount, _exclude_amount)
ONE_OF_THREE = Pattern(_allows_place, _exclude_by_place)
