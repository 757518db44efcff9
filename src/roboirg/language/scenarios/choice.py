"""Choose what is said of an episode: how the goal follows, then the scenario.

All are equally likely, so that no frame goes with a value.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from roboirg.core.errors import check_names
from roboirg.core.goal_slots import COLOR_SLOTS
from roboirg.language.grounded import LEFT, Clue
from roboirg.language.instruction import REFERENCE
from roboirg.language.places import USUAL, SpokenPlace, spoken_places
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.rivals.balanced_rivals import balanced_rival
from roboirg.language.rivals.pair_draw import draw_order
from roboirg.language.rivals.value_pair import rival_pairs
from roboirg.language.scenarios.amounts import hidden_fields
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
from roboirg.language.scenarios.markup import Slot, slots_said
from roboirg.language.scenarios.scenario import PERSON, Scenario
from roboirg.language.settings import all_settings
from roboirg.language.settings.grounded import clues_of
from roboirg.language.settings.reasoning import in_turn

_DESCRIBED = ("place", "clue", "aside", "rest", "kept")
"""Slots for what is described; a scenario fits the things that have those that it names."""
_ANY = "any"
"""The form of a place that is said after a noun, as a spot where there is one."""


class Chosen(NamedTuple):
    """What is said.

    Attributes:
        scenario: the scenario.
        introduced: the values that its words name.
        remark: the name of the remark that chooses; empty if none does.
    """

    scenario: Scenario
    introduced: Introduced
    remark: str


class _Fitting(NamedTuple):
    """A scenario that fits an episode, and the fields of the goal that it leaves to its context."""

    scenario: Scenario
    hidden: frozenset[str]


class _Sayable(NamedTuple):
    """A way to lead to the goal, and the scenarios that can say it."""

    offer: Offer
    scenarios: list[Scenario]


def choose(
    request: InstructionRequest, setting: str, scenarios: Sequence[Scenario]
) -> Chosen | None:
    """Return what is said in a setting that does not refuse; None if no scenario fits."""
    sampler, offers = request.sampler, all_settings()[setting].offers
    fitting = [
        _Fitting(scenario, _hidden_by(scenario, request))
        for scenario in scenarios
        if _fits(scenario, request)
    ]
    sayable: list[_Sayable] = []
    if isinstance(offers, str):
        check_names(f"way to the goal for the offers of {setting}, named", [offers], _OFFERS)
        ways = _OFFERS[offers]
    else:
        ways = offers
    for offer in ways(request):
        saying = [found.scenario for found in fitting if _says(found, offer)]
        if saying:
            sayable.append(_Sayable(offer, saying))
    if not sayable:
        return None
    if offers == "reasoning":
        sayable = [_in_turn(request, sayable)]
    by_frame = {scenario.fields.frame: scenario for way in sayable for scenario in way.scenarios}
    purpose = setting.removeprefix("direct-")
    scenario = sampler.pick_named(f"{purpose} scenario", by_frame)
    offer = next(way.offer for way in sayable if scenario in way.scenarios)
    values = {**goal_values(request), **offer.values}
    if offer.listed is None and scenario.fields.list:
        values |= several("list", _list(request, scenario))
    values |= _people(request, scenario)
    return Chosen(scenario, Introduced(values, offer.notes), offer.remark)


def _in_turn(request: InstructionRequest, sayable: Sequence[_Sayable]) -> _Sayable:
    """Draw a derivation of the pattern whose turn it is, as in language 3."""
    by_pattern: dict[str, dict[str, _Sayable]] = {}
    for way in sayable:
        notes = way.offer.notes
        name = f"{notes['relation']} {notes['reference']} {way.offer.listed}"
        by_pattern.setdefault(str(notes["pattern"]), {})[name] = way
    pattern = in_turn(request.episode, list(by_pattern))
    return request.sampler.pick_named(f"{pattern} derivation", by_pattern[pattern])


def _people(request: InstructionRequest, scenario: Scenario) -> Values:
    """Return two people, who are different, and their pronouns, if a scenario speaks of any."""
    if not scenario.people:
        return {}
    first = request.sampler.pick("person", scenario.people)
    others = [person for person in scenario.people if person is not first]
    second = request.sampler.pick("other person", others)
    values: dict[str, tuple[IntroducedValue, ...]] = {}
    for slot, word, other_word in zip(PERSON, first, second, strict=True):
        values[slot] = (IntroducedValue("", "person", word, word),)
        values[f"{slot}.2"] = (IntroducedValue("", "person", other_word, other_word),)
    return values


def _fits(scenario: Scenario, request: InstructionRequest) -> bool:
    """Return whether an episode has what a scenario needs."""
    needs = scenario.fields.needs
    if needs.colors and len(request.color_values) not in needs.colors:
        return False
    if needs.shown and len(request.scene_colors) not in needs.shown:
        return False
    return not scenario.fields.list or bool(_lengths(request, scenario))


def _hidden_by(scenario: Scenario, request: InstructionRequest) -> frozenset[str]:
    """Return the fields of the goal that a scenario leaves to its context."""
    hidden: set[str] = set()
    for name in scenario.said:
        hidden.update(hidden_fields(scenario.text(f"say.{name}"), request.fields_in(name)))
    return frozenset(hidden)


def _says(found: _Fitting, offer: Offer) -> bool:
    """Return whether a scenario points back in exactly the fields of an offer, by its way."""
    scenario = found.scenario
    derive, notes = scenario.fields.derive, offer.notes
    if found.hidden != set(offer.fields) or offer.listed not in (None, scenario.fields.list):
        return False
    if derive is not None:
        relations = (None, *derive.relations)
        if derive.pattern != notes["pattern"] or notes["relation"] not in relations:
            return False
    return all(_has_words(slot, offer) for slot in slots_said(scenario.text("introduction")))


def _has_words(slot: Slot, offer: Offer) -> bool:
    """Return whether an offer has words for a slot; those of values are always known."""
    if slot.name.partition(".")[0] not in _DESCRIBED:
        return True
    values = offer.values.get(slot.name, ())
    return bool(values) and (values[0].kind != "place" or slot.form in (_ANY, values[0].form))


def _others(request: InstructionRequest, slot: str) -> list[str | int]:
    """Return the values that a slot could have in the scene, without those that it has."""
    own = [value.value for value in request.values_in(slot)]
    possible = itertools.chain.from_iterable(request.alternatives(slot))
    return [value for value in dict.fromkeys(possible) if value not in own]


def _lengths(request: InstructionRequest, scenario: Scenario) -> list[int]:
    """Return the lengths that the list of a scenario can have."""
    slot, wanted = scenario.fields.list, scenario.fields.needs.list or (2, 3)
    least = len(request.values_in(slot))
    most = least + len(_others(request, slot))
    return [length for length in wanted if least <= length <= most]


def _list(request: InstructionRequest, scenario: Scenario) -> Sequence[IntroducedValue]:
    """Draw the goal's values among others, in any order."""
    slot = scenario.fields.list
    members = [*goal_values(request)[slot]]
    size = request.sampler.pick("list length", _lengths(request, scenario))
    left = list(itertools.permutations(_others(request, slot), size - len(members)))
    for other in request.sampler.pick("listed others", left):
        members.append(IntroducedValue(REFERENCE, members[0].kind, other))
    return request.sampler.pick("list order", list(itertools.permutations(members)))


def _direct(request: InstructionRequest) -> Iterator[Offer]:
    """Yield every choice of fields that can point back; the command states the others."""
    fields = [value.field for value in request.goal_values]
    for size in range(1, len(fields) + 1):
        for pointing in itertools.combinations(fields, size):
            yield Offer(pointing, {}, {}, None)


def _spatial(request: InstructionRequest) -> Iterator[Offer]:
    """Yield a spot of a thing of the goal; if none has any, a place after a noun.

    Of amounts both, where there are both: a thing stands for its color.
    """
    colors = request.color_values
    for form in ("spot", None):
        drawn = _drawn_places(request, form)
        if not drawn:
            continue
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
        offer = Offer(fields, {"place": value, f"place.{at}": value}, notes)
        if not request.values_of("amount"):
            yield offer
            return
        yield _with_others_stated(request, colors[at], offer)


def _with_others_stated(request: InstructionRequest, thing: GoalValue, offer: Offer) -> Offer:
    """Return an offer for amounts, of which only one color is found out: the first one."""
    values = goal_values(request, request.color_values.index(thing))
    return offer._replace(fields=["colors.0"], values={**values, **offer.values})


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
    fields = {value.field for value in (*clues, *request.values_in(thing.slot))}
    notes = {"touched": [thing.slot], "pattern": clue.kind, "patterns": [clue.kind]}
    offer = Offer(fields, _seen(thing, clue), notes)
    if thing.slot == "counts":
        kept = (IntroducedValue(REFERENCE, "number", LEFT),)
        offer = Offer(["colors.0", "counts.0"], {"kept": kept}, notes)
    elif request.values_of("amount"):
        offer = _with_others_stated(request, thing, offer)
    yield offer


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
    fields = [value.field for value in pair if pair.ordered or value is pair.meant]
    if pair.slot == "counts":
        fields.append("colors.0")  # the only one, at which the words for them point, too
    rival = IntroducedValue(pair.rival.slot, pair.meant.slot_type, pair.rival.value)
    both = (named(pair.meant), rival) if order.meant_first else (rival, named(pair.meant))
    aimed = "former" if order.meant_first == order.points_at_meant else "latter"
    remark = aimed if order.points_at_meant else f"not_{aimed}"
    notes: dict[str, object] = {
        "rival": pair.rival.value,
        "rival_slot": pair.slot,
        "rival_position": "second" if order.meant_first else "first",
        "rival_reference": remark,
        "candidates": {pair.slot: [value.value for value in both]},
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
    said = [value.value for value in introduced.values.get("list", ())]
    said += [value.value for value in request.goal_values]
    for slot, kind in {value.slot: value.slot_type for value in request.goal_values}.items():
        others: Sequence[str | int] = request.task.commands.colors
        if slot not in COLOR_SLOTS:
            others = _others(request, slot)
        for other in others:
            if other not in said:
                rival = (IntroducedValue(REFERENCE, kind, other),)
                yield introduced.with_values(**{f"rival {slot}": rival})
