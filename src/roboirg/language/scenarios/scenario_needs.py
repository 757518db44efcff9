"""What the fields of a scenario, a text template, need of each other, whatever the episode."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping

from roboirg.core.goal_slots import SLOT_TYPE_NAMES
from roboirg.language.request import AMOUNT_FIELD
from roboirg.language.scenarios.amounts import SLOTS, hidden_fields
from roboirg.language.scenarios.markup import pointers_in, slots_in
from roboirg.language.scenarios.scenario import REMARKS, Scenario
from roboirg.language.scenarios.written import Mistakes
from roboirg.language.settings import all_settings
from roboirg.language.settings.setting import Setting

CONTEXTUAL = ("reinforcement", "distractors", "competing", "cue")
"""The fields that contextual says."""
_FEWEST_PEOPLE = 2
"""Of whom a scenario can speak: ``person`` and ``person.2``."""


def scenario_settings() -> Mapping[str, Setting]:
    """Return the settings for which scenarios are written, by name.

    Explicit has no scenarios, and contextual says those of direct.
    """
    without_scenarios = ("", "explicit", "contextual")
    return {
        name: setting
        for name, setting in all_settings().items()
        if setting.content_plans not in without_scenarios
    }


def sentence_names(stated: Collection[str]) -> list[str]:
    """Return the names of all fields of a scenario that can hold sentences.

    For a task whose commands state ``color``: ``introduction``, ``cue`` …, ``say.color``,
    ``resolved.color``.
    """
    names = ["introduction", *CONTEXTUAL, *REMARKS, "lead", "resolved.lead"]
    for name in stated:
        names += [f"say.{name}", f"resolved.{name}"]
    return names


def check_needs(scenario: Scenario, stated: Collection[str], mistakes: Mistakes) -> None:
    """Add a mistake for all that a scenario lacks of what its setting and its other fields need.

    A scenario is a text template: a scenario of the setting ``direct-rival`` must have the remarks
    that choose one of two values, and one of ``reasoning`` the table ``derive``.

    Args:
        scenario: whose fields are each of the right type.
        stated: the fields of the task's commands: ``color``, ``repeats``.
        mistakes: of the file, at the scenario.
    """
    fields = scenario.fields
    settings = scenario_settings()
    if fields.setting not in settings:
        mistakes.check_names("setting", [fields.setting], settings)
        return
    setting = settings[fields.setting]
    _check_presence(scenario, setting, mistakes)
    if not scenario.said:
        mistakes.add(f"has no say; write say.{' or say.'.join(stated)}")
    has_derive = fields.derive is not None
    if has_derive != (setting.content_plans == "reasoning"):
        mistakes.add("must have derive if its setting is reasoning, and only then")
    if fields.people is not None:
        names_of_people = set(itertools.chain.from_iterable(fields.people.values()))
        if len(names_of_people) < _FEWEST_PEOPLE:
            mistakes.add("has fewer than two people; leave people out to speak of anybody")
    if fields.list:
        slots = sorted(SLOT_TYPE_NAMES.keys() & slots_of(stated))
        mistakes.at("list").check_names("slot", [fields.list], slots)
    _check_sentences(scenario, mistakes)


def _check_presence(scenario: Scenario, setting: Setting, mistakes: Mistakes) -> None:
    """Add a mistake if a scenario lacks a sentence that its setting says, or has an empty one.

    The mistake names all of them: *has no cue and no lead; direct needs introduction, …*.
    """
    needed: list[str] = ["introduction"]
    if setting.name == "direct":
        needed += CONTEXTUAL
    if setting.content_plans == "direct-rival":
        needed += REMARKS
    lacking = []
    for name in dict.fromkeys([*needed, *scenario.texts]):
        if not any(scenario.texts.get(name, ())):
            lacking.append(name)
    if lacking:
        mistakes.add(f"has no {' and no '.join(lacking)}; {setting.name} needs {', '.join(needed)}")


def _check_sentences(scenario: Scenario, mistakes: Mistakes) -> None:
    """Add a mistake for each sentence of a scenario that does not speak of what it must.

    Competing remarks name a value that is not meant, ``{rival color}``; remarks that choose point
    back, ``<former color: the former>``; and all alternatives for a field of the command leave the
    same fields of the goal to the introduction.
    """
    for text in scenario.texts.get("competing", ()):
        if not any(name.startswith("rival ") for name in slots_in(text)):
            mistakes.add("has a competing remark that names no {rival …}")
    for name in REMARKS:
        for text in scenario.texts.get(name, ()):
            if not any(pointers_in(text)):
                mistakes.add("has a remark that points at nothing")
    for name in scenario.said:
        hidden = {tuple(hidden_fields(text, [name])) for text in scenario.texts[f"say.{name}"]}
        if len(hidden) > 1:
            mistakes.add(f"has words in say.{name} that leave different fields open")


def slots_of(stated: Collection[str]) -> set[str]:
    """Return the slots that a task's sentences can have for its goal: ``colors`` and ``colors.0``.

    `stated` has the fields of its commands.
    """
    if AMOUNT_FIELD in stated:
        return {*SLOTS, *stated}
    return {*stated, *(name.partition(".")[0] for name in stated)}
