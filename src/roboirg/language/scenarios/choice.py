"""Choose what is said of an episode: how the goal follows, the class of expression, the scenario.

In this order, and all equally likely, so that neither class nor frame goes with a value.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from roboirg.language.grounded import Clue
from roboirg.language.instruction import REFERENCE
from roboirg.language.places import USUAL, SpokenPlace, spoken_places
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.rivals.balanced_rivals import balanced_rival
from roboirg.language.rivals.pair_draw import draw_order
from roboirg.language.rivals.value_pair import rival_pairs
from roboirg.language.scenarios.derived import derivations_of
from roboirg.language.scenarios.introduced import (
    Introduced,
    IntroducedValue,
    Offer,
    Values,
    goal_values,
    named,
    several,
)
from roboirg.language.scenarios.markup import Slot, Text, slots_said
from roboirg.language.scenarios.scenario import PERSON, Scenario
from roboirg.language.settings.grounded import clues_of
from roboirg.language.settings.reasoning import BLOCK

_DESCRIBED = ("place", "clue", "aside", "rest")
"""Slots for a thing that is described; a scenario fits the things that have those that it names."""


class Chosen(NamedTuple):
    """What is said.

    Attributes:
        scenario: the scenario.
        introduced: the values that its words name.
        first: the words for the first of its fields.
        remark: the name of the remark that chooses; empty if none does.
    """

    scenario: Scenario
    introduced: Introduced
    first: Text
    remark: str


def choose(
    request: InstructionRequest, setting: str, scenarios: Sequence[Scenario]
) -> Chosen | None:
    """Return what is said in a setting that does not refuse; None if no scenario fits."""
    sampler = request.sampler
    known = [scenario for scenario in scenarios if _fits(scenario, request)]
    possible = _OFFERS[setting](request)
    offers = [offer for offer in possible if any(_says(scenario, offer) for scenario in known)]
    if not offers:
        return None
    if setting == "reasoning":
        offers = [_in_turn(request, offers)]
    saying = [scenario for scenario in known if any(_says(scenario, offer) for offer in offers)]
    purpose = setting.removeprefix("direct-")
    kinds = {kind: kind for scenario in saying for kind in scenario.classes}
    kind = sampler.pick_named(f"{purpose} class", kinds)
    of_kind = {scenario.fields.frame: scenario for scenario in saying if kind in scenario.classes}
    scenario = sampler.pick_named(f"{purpose} scenario", of_kind)
    offer = next(offer for offer in offers if _says(scenario, offer))
    words = sampler.pick(f"{purpose} words", scenario.classes[kind])
    values = {**goal_values(request), **offer.values}
    if offer.listed is None and scenario.fields.list:
        values |= several("list", _list(request, scenario))
    values |= _people(request, scenario)
    return Chosen(scenario, Introduced(values, offer.notes), words, offer.remark)


def _in_turn(request: InstructionRequest, offers: Sequence[Offer]) -> Offer:
    """Draw a derivation of the pattern whose turn it is, as in language 3."""
    patterns = list(dict.fromkeys(str(offer.notes["pattern"]) for offer in offers))
    index = request.episode.index
    pattern = patterns[(index + index // BLOCK) % len(patterns)]
    derivations: dict[str, Offer] = {}
    for offer in offers:
        if offer.notes["pattern"] == pattern:
            name = f"{offer.notes['relation']} {offer.notes['reference']} {offer.listed}"
            derivations[name] = offer
    return request.sampler.pick_named(f"{pattern} derivation", derivations)


def _people(request: InstructionRequest, scenario: Scenario) -> Values:
    """Return two people, who are different, and their pronouns, if a scenario speaks of any."""
    if not scenario.people:
        return {}
    one = request.sampler.pick("person", scenario.people)
    left = [each for each in scenario.people if each is not one]
    other = request.sampler.pick("other person", left)
    return {
        f"{slot}{number}": (IntroducedValue("", "person", word, word),)
        for number, words in (("", one), (".2", other))
        for slot, word in zip(PERSON, words, strict=True)
    }


def _fits(scenario: Scenario, request: InstructionRequest) -> bool:
    """Return whether an episode has what a scenario needs."""
    needs, slot = scenario.fields.needs, scenario.fields.list
    return (
        (not needs.colors or len(request.color_values) in needs.colors)
        and (not needs.shown or len(request.scene_colors) in needs.shown)
        and (not slot or bool(_lengths(request, scenario)))
    )


def _says(scenario: Scenario, offer: Offer) -> bool:
    """Return whether a scenario points back in exactly the fields of an offer, by its way."""
    fields, notes = scenario.fields, offer.notes
    derive = fields.derive
    return (
        set(scenario.said) == set(offer.fields)
        and offer.listed in (None, fields.list)
        and all(_has_words(slot, offer) for slot in slots_said(scenario.text("introduction")))
        and (
            derive is None
            or (
                derive.pattern == notes["pattern"]
                and notes["relation"] in (None, *derive.relations)
            )
        )
    )


def _has_words(slot: Slot, offer: Offer) -> bool:
    """Return whether an offer has words for a slot; those of values are always known."""
    if slot.name.partition(".")[0] not in _DESCRIBED:
        return True
    values = offer.values.get(slot.name, ())
    return bool(values) and (values[0].kind != "place" or values[0].form == slot.form)


def _of_slot(request: InstructionRequest, slot: str) -> list[GoalValue]:
    return [one for one in request.goal_values if one.slot == slot]


def _others(request: InstructionRequest, slot: str) -> list[str | int]:
    """Return the values that a slot could have in the scene, without those that it has."""
    own = {one.value for one in _of_slot(request, slot)}
    possible = itertools.chain.from_iterable(request.alternatives(slot))
    return [one for one in dict.fromkeys(possible) if one not in own]


def _lengths(request: InstructionRequest, scenario: Scenario) -> list[int]:
    """Return the lengths that the list of a scenario can have."""
    slot, wanted = scenario.fields.list, scenario.fields.needs.list or (2, 3)
    meant = len(_of_slot(request, slot))
    possible = meant + len(_others(request, slot))
    return [one for one in wanted if meant <= one <= possible]


def _list(request: InstructionRequest, scenario: Scenario) -> Sequence[IntroducedValue]:
    """Draw the goal's values among others, in any order."""
    slot = scenario.fields.list
    own, others = goal_values(request)[slot], _others(request, slot)
    size = request.sampler.pick("list length", _lengths(request, scenario))
    left = list(itertools.permutations(others, size - len(own)))
    drawn = request.sampler.pick("listed others", left)
    values = [*own, *(IntroducedValue(REFERENCE, own[0].kind, one) for one in drawn)]
    return request.sampler.pick("list order", list(itertools.permutations(values)))


def _direct(request: InstructionRequest) -> Iterator[Offer]:
    """Yield every choice of fields that can point back; the command states the others."""
    fields = [value.field for value in request.goal_values]
    for size in range(1, len(fields) + 1):
        for pointing in itertools.combinations(fields, size):
            yield Offer(pointing, {}, {}, None)


def _spatial(request: InstructionRequest) -> Iterator[Offer]:
    """Yield a place after a noun, and a spot, if there are such words for a thing of the goal."""
    colors = request.color_values
    for form in (None, "spot"):
        drawn = _drawn_places(request, form)
        if drawn:
            # Of two things only that with the shorter words has a place.
            at, place = min(drawn.items(), key=lambda item: len(item[1].said(form)))
            words = place.said(form)
            value = (IntroducedValue(colors[at].slot, "place", colors[at].value, words, form),)
            notes: dict[str, object] = {
                "landmarks": [words],
                "landmark_classes": [int(place.kind)],
                "frame": request.frame,
            }
            fields = [color.field for color in colors]
            yield Offer(fields, {"place": value, f"place.{at}": value}, notes)


def _drawn_places(request: InstructionRequest, form: str | None) -> dict[int, SpokenPlace]:
    """Draw a place for each color of the goal, by its number, that has one in this form.

    The class is drawn first, or most places would be extremes.
    """
    found: dict[int, SpokenPlace] = {}
    places = spoken_places(request.episode.scene, request.task.commands.pointed, request.frame)
    for at, color in enumerate(request.color_values):
        things = request.objects_to_point_at(color)
        known = [place for place in places if place.thing in things and place.said(form)]
        possible = [place for place in known if place.kind <= USUAL] or known[:1]
        if possible:
            kinds = list(dict.fromkeys(place.kind for place in possible))
            kind = request.sampler.pick(f"{form} class-{color.field}", kinds)
            of_kind = [place for place in possible if place.kind == kind]
            found[at] = request.sampler.pick(f"{form} place-{color.field}", of_kind)
    return found


def _grounded(request: InstructionRequest) -> Iterator[Offer]:
    clues = clues_of(request, spoken=True)
    if not clues:
        return
    # Of two things only that with the shorter words is described.
    thing, clue = min(clues.items(), key=lambda item: len(item[1].words))
    alike = [value for value in request.goal_values if value.slot == thing.slot]
    fields = {value.field for value in (*clues, *alike)}
    notes: dict[str, object] = {
        "touched": [thing.slot],
        "pattern": clue.kind,
        "patterns": [clue.kind],
    }
    yield Offer(fields, _seen(thing, clue), notes)


def _seen(thing: GoalValue, clue: Clue) -> Values:
    """Return the slots for a clue; for one that sets two things aside, those of what is left."""
    if not clue.aside:
        seen = (IntroducedValue(thing.slot, "clue", thing.value, clue.words),)
        _, _, number = thing.field.partition(".")
        return {"clue": seen, f"clue.{number}": seen}
    aside = [IntroducedValue("", "place", place, place) for place in clue.aside]
    return {
        "rest": (IntroducedValue(thing.slot, "clue", thing.value, "one"),),
        **several("aside", aside),
    }


def _rival(request: InstructionRequest) -> Iterator[Offer]:
    """Yield a pair whose partners make both values equally likely."""
    pair = balanced_rival(request, rival_pairs(request))
    order = draw_order(request)
    fields = [one.field for one in pair if pair.ordered or one is pair.meant]
    rival = IntroducedValue(pair.rival.slot, pair.meant.slot_type, pair.rival.value)
    both = (named(pair.meant), rival) if order.meant_first else (rival, named(pair.meant))
    aimed = "former" if order.meant_first == order.points_at_meant else "latter"
    remark = aimed if order.points_at_meant else f"not_{aimed}"
    notes: dict[str, object] = {
        "rival": pair.rival.value,
        "rival_slot": pair.slot,
        "rival_position": "second" if order.meant_first else "first",
        "rival_reference": remark,
        "candidates": {pair.slot: [one.value for one in both]},
    }
    yield Offer(fields, {**several("list", both), "taken": (rival,)}, notes, pair.slot, remark)


_OFFERS: Mapping[str, Callable[[InstructionRequest], Iterable[Offer]]] = {
    "direct": _direct,
    "reasoning": derivations_of,
    "spatial": _spatial,
    "grounded": _grounded,
    "direct-rival": _rival,
}


def rival_values(request: InstructionRequest, introduced: Introduced) -> Iterator[Introduced]:
    """Yield the slots with another value for a competing remark: ``rival color`` of each color."""
    said = {one.value for one in introduced.values.get("list", ())}
    for slot, kind in {one.slot: one.slot_type for one in request.goal_values}.items():
        own = {one.value for one in _of_slot(request, slot)}
        colors: Sequence[str | int] = request.task.commands.colors
        for other in colors if kind == "color" else _others(request, slot):
            if other not in said | own:
                rival = (IntroducedValue(REFERENCE, kind, other),)
                yield introduced.with_values(**{f"rival {slot}": rival})
