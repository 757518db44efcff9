"""Choose what is said of an episode: how the goal follows, the class of expression, the scenario.

In this order, and all equally likely, so that neither class nor frame goes with a value.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from roboirg.language.grounded import Clue
from roboirg.language.instruction import REFERENCE
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
from roboirg.language.scenarios.markup import Text, slots_in
from roboirg.language.scenarios.scenario import PERSON, Scenario
from roboirg.language.settings.grounded import clues_of
from roboirg.language.settings.reasoning import BLOCK
from roboirg.language.settings.spatial import draw_landmarks

_DESCRIBED = ("place", "clue", "aside", "rest")
"""Slots for a thing that is described; a scenario fits the things that have those that it names."""

_HEAVY = ("second", "third", "corner")
"""Words of clues that are hard to follow: *right next to the one second from your left*."""


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


class _Sayable(NamedTuple):
    """A way to lead to the goal, and the scenarios that say it."""

    offer: Offer
    scenarios: Sequence[Scenario]


def choose(
    request: InstructionRequest, setting: str, scenarios: Sequence[Scenario]
) -> Chosen | None:
    """Return what is said in a setting that does not refuse; None if no scenario fits."""
    sampler = request.sampler
    known = [scenario for scenario in scenarios if _fits(scenario, request)]
    sayable: list[_Sayable] = []
    for offer in _OFFERS[setting](request):
        able = [scenario for scenario in known if _says(scenario, offer)]
        if able:
            sayable.append(_Sayable(offer, able))
    if not sayable:
        return None
    if setting == "reasoning":
        offer, saying = _in_turn(request, sayable)
    else:
        ((offer, saying),) = sayable
    purpose = setting.removeprefix("direct-")
    kinds = {kind: kind for scenario in saying for kind in scenario.classes}
    kind = sampler.pick_named(f"{purpose} class", kinds)
    of_kind = {scenario.fields.frame: scenario for scenario in saying if kind in scenario.classes}
    scenario = sampler.pick_named(f"{purpose} scenario", of_kind)
    words = sampler.pick(f"{purpose} words", scenario.classes[kind])
    values = {**goal_values(request), **offer.values}
    if offer.listed is None and scenario.fields.list:
        values |= several("list", _list(request, scenario))
    values |= _people(request, scenario)
    return Chosen(scenario, Introduced(values, offer.notes), words, offer.remark)


def _in_turn(request: InstructionRequest, sayable: Sequence[_Sayable]) -> _Sayable:
    """Draw a derivation of the pattern whose turn it is, as in language 3."""
    patterns = list(dict.fromkeys(str(way.offer.notes["pattern"]) for way in sayable))
    index = request.episode.index
    pattern = patterns[(index + index // BLOCK) % len(patterns)]
    derivations: dict[str, _Sayable] = {}
    for way in sayable:
        notes = way.offer.notes
        if notes["pattern"] == pattern:
            name = f"{notes['relation']} {notes['reference']} {way.offer.listed}"
            derivations[name] = way
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
        and offer.values.keys()
        >= {
            name
            for name in slots_in(scenario.text("introduction"))
            if name.partition(".")[0] in _DESCRIBED
        }
        and (
            derive is None
            or (
                derive.pattern == notes["pattern"]
                and notes["relation"] in (None, *derive.relations)
            )
        )
    )


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


def _spatial(request: InstructionRequest) -> Iterator[Offer]:
    marks = draw_landmarks(request)
    # Of a single cube "at your far left" may be false; it is the one farthest to the left.
    phrases = [mark.phrase.replace("at your far", "farthest to your") for mark in marks]
    at = _plainest(phrases)
    color = request.color_values[at]
    place = (IntroducedValue(color.slot, "place", color.value, phrases[at]),)
    notes: dict[str, object] = {
        "landmarks": [phrases[at]],
        "landmark_classes": [marks[at].level],
        "frame": request.frame,
    }
    fields = [one.field for one in request.color_values]
    yield Offer(fields, {"place": place, f"place.{at}": place}, notes)


def _grounded(request: InstructionRequest) -> Iterator[Offer]:
    clues = clues_of(request, _HEAVY)
    at = _plainest([clue.words for clue in clues.values()])
    thing, clue = list(clues.items())[at]
    notes: dict[str, object] = {
        "touched": [thing.slot],
        "pattern": clue.kind,
        "patterns": [clue.kind],
    }
    yield Offer([one.field for one in clues], _seen(thing, clue, at), notes)


def _seen(thing: GoalValue, clue: Clue, at: int) -> Values:
    """Return the slots for a clue; for one that sets two things aside, those of what is left."""
    if not clue.aside:
        seen = (IntroducedValue(thing.slot, "clue", thing.value, clue.spoken),)
        return {"clue": seen, f"clue.{at}": seen}
    aside = [IntroducedValue("", "place", place, place) for place in clue.aside]
    return {
        "rest": (IntroducedValue(thing.slot, "clue", thing.value, "one"),),
        **several("aside", aside),
    }


def _plainest(words: Sequence[str]) -> int:
    """Return which of several things is described, the shortest way; the others are named."""
    return min(range(len(words)), key=lambda at: len(words[at]))


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
    "direct": lambda request: [Offer([one.field for one in request.goal_values], {}, {}, None)],
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
