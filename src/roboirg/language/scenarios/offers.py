"""The ways to the goal that scenarios can say, by the name of the setting that has them.

- *offer*: one of these ways: which fields of the command can point back, and at which values. *The
  cube on the left* is named first, and *it* then stands for the color.
- *place*: where a thing stands; *clue*: what only who sees the scene or the video can know.
- *form*: how a place is said: as a ``spot``, or after a noun.
- *notes*: what the metadata of the instruction say of the offer.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping

from roboirg.language.clues import CUBES_LEFT_OVER, Clue
from roboirg.language.instruction import REFERENCE
from roboirg.language.places import PlaceClass, SpokenPlace, spoken_places
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.rivals import (
    PairOrder,
    ValuePair,
    balanced_rival,
    draw_order,
    rival_pairs,
)
from roboirg.language.scenarios.derived import derivations_of
from roboirg.language.scenarios.introduced import (
    IntroducedValue,
    Offer,
    Values,
    goal_values,
    named,
    several,
)
from roboirg.language.settings.grounded import clues_of


def _direct(request: InstructionRequest) -> Iterator[Offer]:
    """Yield every choice of fields that can point back; the command states the others."""
    fields = [value.field for value in request.goal_values]
    for size in range(1, len(fields) + 1):
        for pointing in itertools.combinations(fields, size):
            yield Offer(pointing, {}, {}, None)


def _spatial(request: InstructionRequest) -> Iterator[Offer]:
    """Yield words for where a thing of the goal stands, as a way to lead to its color.

    A spot, *on the left*, is preferred to words after a noun, *the cube nearest to the button*.
    Goals with amounts may be said either way, so both are yielded; only one of their colors is
    found out.
    """
    has_amounts = bool(request.values_of("amount"))
    for form in ("spot", None):  # None: words after a noun
        places = _drawn_places(request, form)
        if not places:
            continue
        # Of two things only that with the shorter words has a place.
        number = min(places, key=lambda at: len(places[at].said(form)))
        offer = _placed(request, number, places[number], form)
        if not has_amounts:
            yield offer
            return
        yield _with_others_stated(request, request.color_values[number], offer)


def _placed(request: InstructionRequest, at: int, place: SpokenPlace, form: str | None) -> Offer:
    """Return the way to the goal by a place: *the cube on the left* gives the color of that cube.

    The color has the index `at` in the goal; the command points back at the place. `form` is how
    the place is said, ``spot`` or None for after a noun.
    """
    colors = request.color_values
    words = place.said(form)
    value = (IntroducedValue(colors[at].slot, "place", colors[at].value, words, form),)
    notes: dict[str, object] = {
        "landmarks": [words],
        "landmark_classes": [int(place.kind)],
        "frame": request.frame,
    }
    pointing_fields = [color.field for color in colors]
    return Offer(pointing_fields, {"place": value, f"place.{at}": value}, notes)


def _with_others_stated(request: InstructionRequest, thing: GoalValue, offer: Offer) -> Offer:
    """Return an offer for amounts, of which only one color is found out: the first one."""
    values = goal_values(request, request.color_values.index(thing))
    return offer._replace(fields=["colors.0"], values={**values, **offer.values})


def _drawn_places(request: InstructionRequest, form: str | None) -> dict[int, SpokenPlace]:
    """Return a drawn place for each color of the goal that has one, by the color's index.

    For the goal red and blue it may be ``{0: on the left, 1: next to the button}``. The class of a
    place is drawn first, or most places would be of the most frequent class. `form` is how it is
    said.
    """
    found: dict[int, SpokenPlace] = {}
    for index, color in enumerate(request.color_values):
        places = _places_of(request, color, form)
        if places:
            kinds = list(dict.fromkeys(place.kind for place in places))
            kind = request.sampler.pick(f"{form} class-{color.field}", kinds)
            of_kind = [place for place in places if place.kind == kind]
            found[index] = request.sampler.pick(f"{form} place-{color.field}", of_kind)
    return found


def _places_of(
    request: InstructionRequest, color: GoalValue, form: str | None
) -> list[SpokenPlace]:
    """Return the places of the things of a color that can be said in a form.

    Unusual words, *third closest to you*, are taken only if there are no others, and only one of
    them.
    """
    things = request.objects_to_point_at(color)
    places = spoken_places(request.episode.scene, request.task.things.pointed, request.frame)
    known = [place for place in places if place.thing in things and place.said(form)]
    usual = [place for place in known if place.kind < PlaceClass.UNUSUAL]
    return usual or known[:1]


def _grounded(request: InstructionRequest) -> Iterator[Offer]:
    """Yield one way to the goal: what only the scene or the video shows of a slot that is drawn.

    *the cube in the middle* is introduced, and the command points back at it.
    """
    clues = clues_of(request)
    if not clues:
        return
    slots = list(dict.fromkeys(value.slot for value in clues))
    slot = request.sampler.pick("seen slot", slots)
    # Of two things only that with the shorter words is described.
    values_of_slot = [value for value in clues if value.slot == slot]
    described_value = min(values_of_slot, key=lambda value: len(clues[value].words))
    yield _clued(request, described_value, clues[described_value])


def _clued(request: InstructionRequest, value: GoalValue, clue: Clue) -> Offer:
    """Return the way to the goal by a clue, words for what is seen that lead to one of its values.

    The command points back at the clue. *All but three* gives a number of cubes and their only
    color.
    """
    notes = {"touched": [value.slot], "pattern": clue.kind, "patterns": [clue.kind]}
    if value.slot == "counts":  # "all but three"
        kept = (IntroducedValue(REFERENCE, "number", CUBES_LEFT_OVER),)
        return Offer(["colors.0", "counts.0"], {"kept": kept}, notes)
    fields = [value.field for value in request.values_in(value.slot)]
    offer = Offer(fields, _seen(value, clue), notes)
    if request.values_of("amount"):
        return _with_others_stated(request, value, offer)
    return offer


def _seen(value: GoalValue, clue: Clue) -> Values:
    """Return what is introduced for a clue, words for what is seen that lead to a value, by slot.

    A clue that sets two things aside names their places, ``aside.0`` and ``aside.1``, and ``rest``
    for the thing that is left. Numbers of cubes at a side are ``beside``; all others are ``clue``.
    """
    if clue.aside:
        aside = [IntroducedValue("", "place", place, place) for place in clue.aside]
        rest = IntroducedValue(value.slot, "clue", value.value, "one")
        return {"rest": (rest,), **several("aside", aside)}
    seen = IntroducedValue(value.slot, "clue", value.value, clue.words)
    counted = IntroducedValue(value.slot, "clue", value.value, clue.short)
    if clue.kind == "counts":
        return {"beside": (seen,), "counted": (counted,)}
    _, _, number = value.field.partition(".")
    return {"clue": (seen,), f"clue.{number}": (seen,), "counted": (counted,)}


def _rival(request: InstructionRequest) -> Iterator[Offer]:
    """Yield one way to the goal: its value and another one are named, and a remark chooses.

    *Red or blue? The latter.* The other value, a rival, is drawn so that both values are meant
    equally often.
    """
    pair = balanced_rival(request, rival_pairs(request))
    order = draw_order(request)
    meant = named(pair.meant)
    rival = IntroducedValue(pair.rival.slot, pair.meant.slot_type, pair.rival.value)
    both = [meant, rival] if order.is_meant_first else [rival, meant]
    values = {**several("list", both), "taken": (rival,)}
    notes = _rival_notes(pair, order)
    yield Offer(_rival_fields(pair), values, notes, pair.slot, _remark_of(order))


def _rival_notes(pair: ValuePair, order: PairOrder) -> dict[str, object]:
    """Return the entries of the metadata for a value and its rival, which is named next to it."""
    candidates = [value.value for value in pair]
    if not order.is_meant_first:
        candidates.reverse()
    return {
        "rival": pair.rival.value,
        "rival_slot": pair.slot,
        "rival_position": "second" if order.is_meant_first else "first",
        "rival_reference": _remark_of(order),
        "candidates": {pair.slot: candidates},
    }


def _remark_of(order: PairOrder) -> str:
    """Return the name of the remark that chooses the value that is meant.

    It points at this value, ``former``, or sets the other one aside, ``not_latter``.
    """
    meant_rank = "former" if order.is_meant_first else "latter"
    rival_rank = "latter" if order.is_meant_first else "former"
    return meant_rank if order.points_at_meant else f"not_{rival_rank}"


def _rival_fields(pair: ValuePair) -> list[str]:
    """Return the fields of the command that point back at one of a pair."""
    if pair.is_ordered:
        return [pair.meant.field, pair.rival.field]
    if pair.slot == "counts":
        return [pair.meant.field, "colors.0"]  # the only color, at which the words point, too
    return [pair.meant.field]


OFFERS: Mapping[str, Callable[[InstructionRequest], Iterable[Offer]]] = {
    "direct": _direct,
    "reasoning": derivations_of,
    "spatial": _spatial,
    "grounded": _grounded,
    "direct-rival": _rival,
}
"""By the name of a setting of ours; explicit and contextual say what others do."""
