"""Choose what is said of an episode: a scenario, and an offer that it says.

All scenarios are equally likely, so that no frame, which is the name of a scenario, goes with a
value.

- *scenario*: what a person says of a task, with slots for values.
- *offer*: one way to lead to the goal: which fields of the command can point back, and at what.
- *match*: a scenario with an offer that it can say; one match of an episode is drawn.
- *remark*: words before the command that choose one of two values.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

from msgspec.structs import replace

from roboirg.core.episode import Episode
from roboirg.core.errors import check_names
from roboirg.core.goal_slots import COLOR_SLOTS
from roboirg.language.instruction import REFERENCE
from roboirg.language.request import InstructionRequest
from roboirg.language.scenarios.amounts import hidden_fields
from roboirg.language.scenarios.introduced import (
    Introduced,
    IntroducedValue,
    Offer,
    Values,
    goal_values,
    several,
)
from roboirg.language.scenarios.markup import Slot, slots_said
from roboirg.language.scenarios.offers import OFFERS
from roboirg.language.scenarios.scenario import PERSON, Scenario
from roboirg.language.settings import all_settings

_DESCRIBED = ("place", "clue", "beside", "counted", "aside", "rest", "kept")
"""Slots for what is described; a scenario fits the things that have those that it names."""
BLOCK = 4
"""Number of episodes after which difficulties repeat; see `in_turn`."""
_USUAL_LENGTHS = (2, 3)
"""Of a list, for a scenario that says nothing about it."""
_ANY = "any"
"""The form of a place that is said after a noun, as a spot where there is one."""


class Chosen(NamedTuple):
    """What is said.

    Attributes:
        scenario: the scenario.
        offer: the way in which it leads to the goal.
        introduced: all values that its words can name.
    """

    scenario: Scenario
    offer: Offer
    introduced: Introduced


class _Match(NamedTuple):
    """A scenario, and an offer that it can say."""

    scenario: Scenario
    offer: Offer


def choose(
    request: InstructionRequest, setting: str, scenarios: Sequence[Scenario]
) -> Chosen | None:
    """Return what is said of an episode: a scenario with its values; None if none fits.

    A scenario is what a person says of a task, with slots for values. One is drawn, with the first
    way to lead to the goal that it can say, an offer; then its list of values and its people.
    """
    matches = list(_matches(request, setting, scenarios))
    if not matches:
        return None
    scenario, offer = _drawn_match(request, setting, matches)
    values = {**goal_values(request), **offer.values}
    if offer.listed is None and scenario.fields.list:
        values |= several("list", _drawn_list(request, scenario))
    values |= _drawn_people(request, scenario)
    return Chosen(scenario, offer, Introduced(values))


def _matches(
    request: InstructionRequest, setting: str, scenarios: Sequence[Scenario]
) -> Iterator[_Match]:
    """Yield each way to lead to the goal with each scenario whose words can say it.

    Such a way is an offer of the setting. A scenario says one that leaves the same fields of the
    goal to the context as its words do: with *it* for the color, an offer that gives the color.
    """
    scenarios_by_hidden: dict[frozenset[str], list[Scenario]] = {}
    for scenario in scenarios:
        if _fits_episode(scenario, request):
            scenarios_by_hidden.setdefault(_hidden_by(scenario, request), []).append(scenario)
    for offer in _offers_of(setting)(request):
        for scenario in scenarios_by_hidden.get(frozenset(offer.fields), []):
            if _can_say(scenario, offer):
                yield _Match(scenario, offer)


def _drawn_match(request: InstructionRequest, setting: str, matches: Sequence[_Match]) -> _Match:
    """Draw a scenario, with the first of the offers, ways to lead to the goal, that it can say.

    In reasoning, the way is drawn first, so that all kinds of reasoning get their turn.
    """
    if all_settings()[setting].offers == "reasoning":
        offer_in_turn = _in_turn(request, matches)
        matches = [match for match in matches if match.offer is offer_in_turn]
    by_frame: dict[str, _Match] = {}
    for match in matches:
        by_frame.setdefault(match.scenario.fields.frame, match)
    purpose = setting.removeprefix("direct-")  # part of the key of a draw, so it has to stay
    return request.sampler.pick_named(f"{purpose} scenario", by_frame)


def _offers_of(setting: str) -> Callable[[InstructionRequest], Iterable[Offer]]:
    """Return what yields the offers of a setting: its own, or that of one of ours."""
    offers = all_settings()[setting].offers
    if not isinstance(offers, str):
        return offers
    check_names(f"way to the goal for the offers of {setting}, named", [offers], OFFERS)
    return OFFERS[offers]


def misfit(request: InstructionRequest, setting: str, scenarios: Sequence[Scenario]) -> str:
    """Return why none of some scenarios of a setting fits an episode, for a message.

    If they fit without their introductions, only the words of a place or a clue are lacking.
    """
    # Without introductions, only the words of places and clues can no longer be lacking.
    without_introductions: list[Scenario] = []
    for scenario in scenarios:
        texts = {**scenario.texts, "introduction": ((),)}
        without_introductions.append(replace(scenario, texts=texts))
    if choose(request, setting, without_introductions):
        return "nothing has the place or clue that the introduction names"
    return "the goal follows in no way that setting, say, list, derive and needs allow"


def _in_turn(request: InstructionRequest, matches: Iterable[_Match]) -> Offer:
    """Draw one way in which the goal follows, of the kind of reasoning whose turn it is.

    A kind, or pattern, is such as ``color exclusion``. Ways of one pattern are told apart by
    relation, reference and listed slot, under which they are drawn.
    """
    by_pattern: dict[str, dict[str, Offer]] = {}
    for _, offer in matches:
        notes = offer.notes
        name = f"{notes['relation']} {notes['reference']} {offer.listed}"
        by_pattern.setdefault(str(notes["pattern"]), {})[name] = offer
    pattern = in_turn(request.episode, list(by_pattern))
    return request.sampler.pick_named(f"{pattern} derivation", by_pattern[pattern])


def in_turn(episode: Episode, patterns: Sequence[str]) -> str:
    """Return an episode's pattern of those that it allows.

    Cycle through the patterns that the episode allows, so that none takes the turns of another.
    Move on by one more after each block of four episodes: otherwise a task with two patterns
    would use only one of them in its hard episodes.
    """
    return patterns[(episode.index + episode.index // BLOCK) % len(patterns)]


def _drawn_people(request: InstructionRequest, scenario: Scenario) -> Values:
    """Return two different people and their pronouns, by slot; empty if a scenario names none.

    The slots of the first are ``person``, ``he`` ..., those of the second ``person.2``, ``he.2``
    ...
    """
    if not scenario.people:
        return {}
    first = request.sampler.pick("person", scenario.people)
    others = [person for person in scenario.people if person is not first]
    second = request.sampler.pick("other person", others)
    values: dict[str, tuple[IntroducedValue, ...]] = {}
    for suffix, person in (("", first), (".2", second)):
        # Each person is a row of words in the order of `PERSON`: "Leo", "he", "him" …
        for slot, word in zip(PERSON, person, strict=True):
            values[f"{slot}{suffix}"] = (IntroducedValue("", "person", word),)
    return values


def _fits_episode(scenario: Scenario, request: InstructionRequest) -> bool:
    """Return whether an episode has the numbers of colors and values that a scenario needs."""
    needs = scenario.fields.needs
    if needs.colors and len(request.color_values) not in needs.colors:
        return False
    if needs.shown and len(request.scene_colors) not in needs.shown:
        return False
    # A scenario with a list needs enough values for it.
    return not scenario.fields.list or bool(_possible_lengths(request, scenario))


def _hidden_by(scenario: Scenario, request: InstructionRequest) -> frozenset[str]:
    """Return the fields of the goal that a scenario leaves to its context."""
    hidden: set[str] = set()
    for name in scenario.said:
        hidden.update(hidden_fields(scenario.text(f"say.{name}"), request.fields_in(name)))
    return frozenset(hidden)


def _can_say(scenario: Scenario, offer: Offer) -> bool:
    """Return whether a scenario has the words for an offer, a way to lead to the goal.

    It has to introduce the list of the offer, if that has one, derive the goal as the offer does,
    and name nothing in its introduction for which the offer has no words. Both leave the same
    fields of the goal open.
    """
    if offer.listed not in (None, scenario.fields.list):
        return False
    derive = scenario.fields.derive  # how the goal follows; in reasoning scenarios only
    if derive is not None:
        if derive.pattern != offer.notes["pattern"]:
            return False
        if offer.notes["relation"] not in (None, *derive.relations):
            return False
    return all(_has_words(slot, offer) for slot in slots_said(scenario.text("introduction")))


def _has_words(slot: Slot, offer: Offer) -> bool:
    """Return whether an offer has words for a slot of a sentence, such as ``{place:spot}``.

    An offer is a way to lead to the goal. Values of the goal always have words. A place must have
    them in the form that is asked for, such as ``spot``.
    """
    if slot.name.partition(".")[0] not in _DESCRIBED:
        return True
    values = offer.values.get(slot.name, ())
    if not values:
        return False
    return values[0].kind != "place" or slot.form in (_ANY, values[0].form)


def _possible_lengths(request: InstructionRequest, scenario: Scenario) -> list[int]:
    """Return the possible numbers of values in the list that a scenario introduces: ``[2, 3]``.

    It holds all values of the goal and perhaps others: with one color of three in the scene, 1 to
    3, of which those are left that the scenario allows, or else the usual ones.
    """
    slot = scenario.fields.list
    num_in_goal = len(request.values_in(slot))
    if not num_in_goal:  # a slot of another task of the file
        return []
    num_in_scene = num_in_goal + len(_others(request, slot))
    wanted = scenario.fields.needs.list or _USUAL_LENGTHS
    return [length for length in wanted if num_in_goal <= length <= num_in_scene]


def _drawn_list(request: InstructionRequest, scenario: Scenario) -> Sequence[IntroducedValue]:
    """Draw the values that a scenario lists: the goal's among others of the scene, in any order.

    For the goal red it may be *blue, red*.
    """
    slot = scenario.fields.list
    members = list(goal_values(request)[slot])
    kind = members[0].kind
    size = request.sampler.pick("list length", _possible_lengths(request, scenario))
    choices = list(itertools.permutations(_others(request, slot), size - len(members)))
    for other in request.sampler.pick("listed others", choices):
        members.append(IntroducedValue(REFERENCE, kind, other))
    return request.sampler.pick("list order", list(itertools.permutations(members)))


def _others(request: InstructionRequest, slot: str) -> list[str | int]:
    """Return the values that a slot could have in the scene, without those of the goal."""
    possible = dict.fromkeys(itertools.chain.from_iterable(request.alternatives(slot)))
    for meant in request.values_in(slot):
        possible.pop(meant.value, None)
    return list(possible)


def rival_values(request: InstructionRequest, introduced: Introduced) -> Iterator[Introduced]:
    """Yield the values of the goal with one more, that is not meant, for remarks that name it.

    For the goal red, the slot ``rival color`` is blue, then green, as far as neither was named in a
    list.
    """
    already_named = [value.value for value in introduced.values.get("list", ())]
    already_named += [value.value for value in request.goal_values]
    kinds = {value.slot: value.slot_type for value in request.goal_values}
    for slot, kind in kinds.items():
        for other in _possible_rivals(request, slot):
            if other not in already_named:
                rival = IntroducedValue(REFERENCE, kind, other)
                yield introduced.with_values(**{f"rival {slot}": (rival,)})


def _possible_rivals(request: InstructionRequest, slot: str) -> Sequence[str | int]:
    """Return the values of which a competing remark can speak: any color, or what the scene has."""
    if slot in COLOR_SLOTS:
        return request.task.things.colors
    return _others(request, slot)
