"""Choose what is said of an episode: how the goal follows, the class of expression, the scenario.

In this order, and all equally likely, so that neither class nor frame goes with a value.
"""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from roboirg.language.grounded import Clue
from roboirg.language.instruction import REFERENCE
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.rivals.balanced_rivals import balanced_rival
from roboirg.language.rivals.pair_draw import draw_order
from roboirg.language.rivals.value_pair import rival_pairs
from roboirg.language.scenarios.derived import Derivation, derivations_of
from roboirg.language.scenarios.introduced import (
    Introduced,
    IntroducedValue,
    as_reference,
    goal_values,
    named,
    several,
)
from roboirg.language.scenarios.markup import Text
from roboirg.language.scenarios.scenario import PERSON, Scenario
from roboirg.language.settings.grounded import clues_of
from roboirg.language.settings.reasoning import BLOCK
from roboirg.language.settings.spatial import draw_landmarks
from roboirg.language.template_sampler import sampler_of

LENGTHS = (2, 3)
"""Of a list that the words introduce."""


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
    remark: str = ""


class _NoScenarioError(Exception):
    """None of the scenarios fits the episode."""


def choose(
    request: InstructionRequest, setting: str, scenarios: Sequence[Scenario]
) -> Chosen | None:
    """Return what is said in a setting that does not refuse; None if no scenario fits."""
    colors, shown = len(request.color_values), len(request.scene_colors)
    known = [
        one
        for one in scenarios
        if colors in (one.fields.needs.colors or (colors,))
        and shown in (one.fields.needs.shown or (shown,))
    ]
    with contextlib.suppress(_NoScenarioError):
        return _with_people(request, _CHOICES[setting](request, known))
    return None


def _with_people(request: InstructionRequest, chosen: Chosen) -> Chosen:
    """Add two people, who are different, and their pronouns, to what is introduced."""
    people = chosen.scenario.people
    if not people:
        return chosen
    one = request.sampler.pick("person", people)
    other = request.sampler.pick("other person", [each for each in people if each is not one])
    added = {
        f"{slot}{number}": (IntroducedValue("", "person", word, word),)
        for number, words in (("", one), (".2", other))
        for slot, word in zip(PERSON, words, strict=True)
    }
    return chosen._replace(introduced=chosen.introduced.with_values(**added))


def _drawn(
    request: InstructionRequest, setting: str, scenarios: Sequence[Scenario]
) -> tuple[Scenario, Text]:
    """Draw the class of the expression in the first field, and then a scenario that has it."""
    classes = sorted({kind for one in scenarios for kind in one.classes})
    if not classes:
        raise _NoScenarioError
    kind = request.sampler.pick(f"{setting} class", classes)
    saying = [one for one in scenarios if kind in one.classes]
    scenario = request.sampler.pick(f"{setting} scenario", saying)
    request.sampler.log.append(f"frame/{scenario.fields.frame}")
    return scenario, request.sampler.pick(f"{setting} words", scenario.classes[kind])


def _says(scenarios: Sequence[Scenario], fields: Sequence[str], slot: str = "") -> list[Scenario]:
    """Return the scenarios that point back in exactly these fields, with a list of a slot."""
    return [
        one for one in scenarios if set(one.said) == set(fields) and one.fields.list == slot
    ]  # fmt: skip


def _direct(request: InstructionRequest, scenarios: Sequence[Scenario]) -> Chosen:
    fields = {one.field for one in request.goal_values}
    saying = [one for one in scenarios if set(one.said) == fields]
    others = {slot: _others(request, slot) for slot in {one.fields.list for one in saying} if slot}
    possible = [
        one for one in saying if not one.fields.list or _lengths(request, one, others)
    ]  # fmt: skip
    scenario, words = _drawn(request, "direct", possible)
    values = goal_values(request)
    if scenario.fields.list:
        values |= several("list", _list(request, scenario, others))
    return Chosen(scenario, Introduced(values), words)


def _of_slot(request: InstructionRequest, slot: str) -> list[GoalValue]:
    return [one for one in request.goal_values if one.slot == slot]


def _others(request: InstructionRequest, slot: str) -> list[str | int]:
    """Return the values that a slot could have in the scene, without those that it has."""
    own = {one.value for one in _of_slot(request, slot)}
    return [one for one in dict.fromkeys(sum(request.alternatives(slot), ())) if one not in own]


def _lengths(
    request: InstructionRequest, scenario: Scenario, others: Mapping[str, Sequence[str | int]]
) -> list[int]:
    """Return the lengths that the list of a scenario can have, given other values by slot."""
    slot, wanted = scenario.fields.list, scenario.fields.needs.list or LENGTHS
    meant = len(_of_slot(request, slot))
    return [one for one in wanted if meant <= one <= meant + len(others[slot])]


def _list(
    request: InstructionRequest, scenario: Scenario, others: Mapping[str, Sequence[str | int]]
) -> list[IntroducedValue]:
    """Draw the goal's values among others, in any order."""
    own = _of_slot(request, scenario.fields.list)
    size = request.sampler.pick("list length", _lengths(request, scenario, others))
    left = list(itertools.permutations(others[scenario.fields.list], size - len(own)))
    values = [named(one) for one in own]
    values += [as_reference(own[0], one) for one in request.sampler.pick("listed others", left)]
    order = request.sampler.pick("list order", list(itertools.permutations(range(size))))
    return [values[at] for at in order]


def _reasoning(request: InstructionRequest, scenarios: Sequence[Scenario]) -> Chosen:
    """Choose a derivation by the turn of its pattern, and then what says it."""
    offered = [
        (derivation, saying)
        for derivation in derivations_of(request)
        if (saying := [one for one in scenarios if offers(one, derivation)])
    ]
    patterns = list(dict.fromkeys(one.pattern for one, _ in offered))
    if not patterns:
        raise _NoScenarioError
    index = request.episode.index
    pattern = patterns[(index + index // BLOCK) % len(patterns)]
    derivation, saying = request.sampler.pick(
        f"{pattern} derivation", [one for one in offered if one[0].pattern == pattern]
    )
    scenario, words = _drawn(request, "reasoning", saying)
    values = derivation.values
    reference = values.get("reference", values.get("taken"))
    notes: dict[str, object] = {
        "pattern": pattern,
        "patterns": list(derivation.patterns or (pattern,)),
        "relation": derivation.relation,
        "reference": None if reference is None else reference[0].value,
    }
    if derivation.listed:
        notes["candidates"] = {derivation.listed: [one.value for one in values["list"]]}
    return Chosen(scenario, Introduced({**goal_values(request), **values}, notes), words)


def offers(scenario: Scenario, derivation: Derivation) -> bool:
    """Return whether a scenario says a derivation."""
    derive = scenario.fields.derive
    return (
        derive is not None
        and derive.pattern == derivation.pattern
        and (derivation.relation is None or derivation.relation in derive.relations)
        and bool(_says([scenario], derivation.fields, derivation.listed))
    )


def _spatial(request: InstructionRequest, scenarios: Sequence[Scenario]) -> Chosen:
    colors = request.color_values
    scenario, words = _drawn(request, "spatial", _says(scenarios, [one.field for one in colors]))
    marks = draw_landmarks(request)
    places = [
        IntroducedValue(color.slot, "place", color.value, mark.phrase)
        for color, mark in zip(colors, marks, strict=True)
    ]
    notes: dict[str, object] = {
        "landmarks": [mark.phrase for mark in marks],
        "landmark_classes": [mark.level for mark in marks],
        "frame": request.frame,
    }
    values = {**goal_values(request), **several("place", places)}
    return Chosen(scenario, Introduced(values, notes), words)


def _grounded(request: InstructionRequest, scenarios: Sequence[Scenario]) -> Chosen:
    clues: Mapping[GoalValue, Clue] = clues_of(request)
    kinds = list(dict.fromkeys(clue.kind for clue in clues.values()))
    saying = _says(scenarios, [value.field for value in clues])
    scenario, words = _drawn(request, "grounded", saying)
    seen = [IntroducedValue(one.slot, "clue", one.value, clue.words) for one, clue in clues.items()]
    touched = list(dict.fromkeys(one.slot for one in clues))
    notes: dict[str, object] = {"touched": touched, "pattern": kinds[0], "patterns": kinds}
    values = {**goal_values(request), **several("clue", seen)}
    return Chosen(scenario, Introduced(values, notes), words)


def _rival(request: InstructionRequest, scenarios: Sequence[Scenario]) -> Chosen:
    """Choose a pair as in language 3, whose partners make both values equally likely."""
    pairs = rival_pairs(replace(request, sampler=sampler_of(request.episode)))
    pair, order = balanced_rival(request, pairs), draw_order(request)
    fields = [one.field for one in pair if pair.ordered or one is pair.meant]
    scenario, words = _drawn(request, "rival", _says(scenarios, fields, pair.slot))
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
    values = {**goal_values(request), **several("list", both), "taken": (rival,)}
    return Chosen(scenario, Introduced(values, notes), words, remark)


_CHOICES: Mapping[str, Callable[[InstructionRequest, Sequence[Scenario]], Chosen]] = {
    "direct": _direct,
    "reasoning": _reasoning,
    "spatial": _spatial,
    "grounded": _grounded,
    "direct-rival": _rival,
}


def rival_values(request: InstructionRequest, introduced: Introduced) -> Iterator[Introduced]:
    """Yield the slots with another value for a competing remark: ``rival color`` of each color."""
    said = {one.value for one in introduced.values.get("list", ())}
    for slot, kind in {one.slot: one.slot_type for one in request.goal_values}.items():
        own = {one.value for one in _of_slot(request, slot)}
        others: Sequence[str | int] = _others(request, slot)
        if kind == "color":
            others = request.task.commands.colors
        for other in others:
            if other not in said | own:
                rival = (IntroducedValue(REFERENCE, kind, other),)
                yield introduced.with_values(**{f"rival {slot}": rival})
