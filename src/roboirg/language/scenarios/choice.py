"""Choose what is said of an episode: a scenario, and the content plan that it puts into words.

All scenarios are equally likely, so that no situation, such as a school trip, goes with a value.

- *scenario*: a template for a text, with slots for values: an introduction, *{person} likes
  {color}.*, and words for the fields of the command, *it*. Its name is its ``frame``.
- *content plan*: one way to say the goal without naming it in the command, whatever the scenario:
  which fields of the command are pronouns, and what the introduction names instead.
- *match*: a scenario with a content plan that it can put into words; one of them is drawn.
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
from roboirg.language.scenarios.content_plans import CONTENT_PLANNERS
from roboirg.language.scenarios.fillers import (
    ANY_LIST,
    ContentPlan,
    Filler,
    Fillers,
    FillersBySlot,
    goal_fillers,
    list_fillers,
)
from roboirg.language.scenarios.markup import Slot, slots_said
from roboirg.language.scenarios.scenario import PERSON, Scenario
from roboirg.language.settings import all_settings

_DESCRIPTION_SLOTS = ("place", "clue", "beside", "counted", "aside", "rest", "kept")
"""Slots that only some content plans fill: they describe a thing, *the cube in the middle*."""
BLOCK = 4
"""Number of episodes after which difficulties repeat; see `in_turn`."""
_USUAL_LENGTHS = (2, 3)
"""Of a list, for a scenario that says nothing about it."""
_ANY_FORM = "any"
"""``{place:any}`` takes a place in whichever form the content plan has it."""


class ScenarioChoice(NamedTuple):
    """What is said of an episode.

    Attributes:
        scenario: the template.
        plan: the way in which it says the goal.
        fillers: of all slots that its sentences can name.
    """

    scenario: Scenario
    plan: ContentPlan
    fillers: Fillers


class _Match(NamedTuple):
    """A scenario, and a content plan that it can put into words."""

    scenario: Scenario
    plan: ContentPlan


def choose(
    request: InstructionRequest, setting: str, scenarios: Sequence[Scenario]
) -> ScenarioChoice | None:
    """Draw the scenario that says an episode, and fill its slots; None if no scenario fits.

    A scenario is a template with slots: *{person} likes {color}. Lift it.* Drawn are, in this
    order, the scenario with its content plan (which words of the command are pronouns), the values
    of its list if it says one, and its people. The log of the draws, in the request, has them in
    this order, too.

    Args:
        request: the episode, with the random draws.
        setting: whose content plans are tried, ``direct``.
        scenarios: of this setting, that may be drawn.
    """
    matches = list(_matches(request, setting, scenarios))
    if not matches:
        return None
    scenario, plan = _draw_match(request, setting, matches)
    values = {**goal_fillers(request), **plan.values}
    if plan.list_slot == ANY_LIST and scenario.fields.list:
        values |= list_fillers("list", _draw_list(request, scenario))
    values |= _draw_people(request, scenario)
    return ScenarioChoice(scenario, plan, Fillers(values))


def _matches(
    request: InstructionRequest, setting: str, scenarios: Sequence[Scenario]
) -> Iterator[_Match]:
    """Yield each content plan of a setting with each scenario that can put it into words.

    A content plan says which fields of the command are pronouns: ``{"color"}``. A scenario, which
    is a template, has words such as *it* for some fields; only scenarios that have them for exactly
    the same fields match. All plans of a scenario come in the order of the setting.
    """
    scenarios_by_open_fields: dict[frozenset[str], list[Scenario]] = {}
    for scenario in scenarios:
        if _fits_episode(scenario, request):
            open_fields = _fields_left_open(scenario, request)
            scenarios_by_open_fields.setdefault(open_fields, []).append(scenario)
    for plan in _content_planner_of(setting)(request):
        for scenario in scenarios_by_open_fields.get(frozenset(plan.fields), []):
            if _can_say(scenario, plan):
                yield _Match(scenario, plan)


def _draw_match(request: InstructionRequest, setting: str, matches: Sequence[_Match]) -> _Match:
    """Draw one of the scenarios that match, with the first content plan that it can say.

    Each scenario (a template, known by its `frame`) is equally likely, however many plans it can
    say. In the reasoning setting the plan is drawn first, so that all kinds of reasoning get their
    turn, and then one of the scenarios that can say it.
    """
    if all_settings()[setting].content_plans == "reasoning":
        drawn_plan = _draw_reasoning_plan(request, matches)
        matches = [match for match in matches if match.plan is drawn_plan]
    by_frame: dict[str, _Match] = {}
    for match in matches:
        by_frame.setdefault(match.scenario.fields.frame, match)
    purpose = setting.removeprefix("direct-")  # part of the key of a draw, so it has to stay
    return request.sampler.pick_named(f"{purpose} scenario", by_frame)


def _content_planner_of(setting: str) -> Callable[[InstructionRequest], Iterable[ContentPlan]]:
    """Return the function that yields the content plans of a setting for an episode.

    A setting brings a function of its own, or names one of our settings, whose function it takes.

    Raises:
        UnknownNameError: there is no setting of ours with that name.
    """
    plans = all_settings()[setting].content_plans
    if not isinstance(plans, str):
        return plans
    kind = f"setting for the content_plans of {setting}, named"
    check_names(kind, [plans], CONTENT_PLANNERS)
    return CONTENT_PLANNERS[plans]


def explain_misfit(request: InstructionRequest, setting: str, scenarios: Sequence[Scenario]) -> str:
    """Return why none of some scenarios fits an episode: *nothing has the place or clue that …*.

    It is called where `choose` has found none. If one would fit without its introduction, the
    introduction names a place or a clue, *the cube in the middle*, that the episode lacks.
    """
    without_introductions = []
    for scenario in scenarios:
        texts = {**scenario.texts, "introduction": ((),)}
        without_introductions.append(replace(scenario, texts=texts))
    if choose(request, setting, without_introductions):
        return "nothing has the place or clue that the introduction names"
    return "the goal follows in no way that setting, say, list, derive and needs allow"


def _draw_reasoning_plan(request: InstructionRequest, matches: Iterable[_Match]) -> ContentPlan:
    """Draw one of the content plans of some matches, of the kind of reasoning whose turn it is.

    Kinds, or patterns, are such as ``color exclusion``; the number of the episode decides which has
    its turn. Among the plans of that pattern the draw is by name: relation, reference and listed
    slot, ``one fewer 3``. These names are hash keys, so their spelling has to stay. The plan itself
    is returned, no copy: `_draw_match` finds its matches by identity.
    """
    plans_by_pattern: dict[str, dict[str, ContentPlan]] = {}
    for _, plan in matches:
        notes = plan.notes
        name = f"{notes['relation']} {notes['reference']} {plan.list_slot}"
        plans_by_pattern.setdefault(str(notes["pattern"]), {})[name] = plan
    pattern = in_turn(request.episode, list(plans_by_pattern))
    return request.sampler.pick_named(f"{pattern} derivation", plans_by_pattern[pattern])


def in_turn(episode: Episode, patterns: Sequence[str]) -> str:
    """Return which of the reasoning patterns that an episode allows has its turn in it.

    Of two patterns, A and B, episodes 0 to 7 have A B A B, B A B A. Consecutive episodes cycle
    through their patterns. After each block of four, in which the difficulties occur in the same
    order, the cycle moves on by one more: otherwise hard episodes, the last of each block, would
    all have B.
    """
    return patterns[(episode.index + episode.index // BLOCK) % len(patterns)]


def _draw_people(request: InstructionRequest, scenario: Scenario) -> FillersBySlot:
    """Draw two different people of a scenario, and return their names and pronouns by slot.

    For Leo and Mia: ``person`` *Leo*, ``he`` *he*, ``him`` *him* …, ``person.2`` *Mia*, ``he.2``
    *she* … Empty if the scenario names no people.
    """
    if not scenario.people:
        return {}
    first = request.sampler.pick("person", scenario.people)
    others = [person for person in scenario.people if person is not first]
    second = request.sampler.pick("other person", others)
    values: dict[str, tuple[Filler, ...]] = {}
    for suffix, person in (("", first), (".2", second)):
        # Each person is a row of words in the order of `PERSON`: "Leo", "he", "him" …
        for slot, word in zip(PERSON, person, strict=True):
            values[f"{slot}{suffix}"] = (Filler("", "person", word),)
    return values


def _fits_episode(scenario: Scenario, request: InstructionRequest) -> bool:
    """Return whether an episode has the numbers of colors and values that a scenario needs.

    A scenario is a template. It may need, for example, a goal of two colors, or values enough for
    the list that it says.
    """
    needs = scenario.fields.needs
    if needs.colors and len(request.color_values) not in needs.colors:
        return False
    if needs.shown and len(request.scene_colors) not in needs.shown:
        return False
    # A scenario with a list needs enough values for it.
    return not scenario.fields.list or bool(_possible_list_lengths(request, scenario))


def _fields_left_open(scenario: Scenario, request: InstructionRequest) -> frozenset[str]:
    """Return the fields of the goal for which the command of a scenario has pronouns.

    A scenario with ``say.color = ["<it color: it>"]`` gives ``{"color"}``: its command, *Lift it*,
    leaves the color to the introduction.
    """
    hidden: set[str] = set()
    for name in scenario.said:
        hidden.update(hidden_fields(scenario.text(f"say.{name}"), request.fields_in(name)))
    return frozenset(hidden)


def _can_say(scenario: Scenario, plan: ContentPlan) -> bool:
    """Return whether a scenario, a template, has the sentences that a content plan needs.

    A content plan is one way to say the goal. The scenario has to list values of the slot of which
    the plan lists some, reason as the plan does, and name nothing in its introduction that the plan
    does not fill. It is assumed that its command has pronouns for the fields of the plan.
    """
    if plan.list_slot not in (ANY_LIST, scenario.fields.list):
        return False
    derive = scenario.fields.derive  # how the goal follows; in reasoning scenarios only
    if derive is not None:
        if derive.pattern != plan.notes["pattern"]:
            return False
        if plan.notes["relation"] not in (None, *derive.relations):
            return False
    return all(_can_fill(slot, plan) for slot in slots_said(scenario.text("introduction")))


def _can_fill(slot: Slot, plan: ContentPlan) -> bool:
    """Return whether a content plan has words for a slot of a sentence, such as ``{place:spot}``.

    Values of the goal, ``{color}``, always have words; whether a description has any, such as a
    place, depends on the plan. A place must also be sayable in the form that the slot asks for:
    ``spot``, *right by the button*, after *It's dusty*; no form after a noun; ``any`` takes both.
    With a place whose form is ``spot``, ``{place:spot}`` and ``{place:any}`` can be filled, and
    ``{place}`` cannot.
    """
    name = slot.name.partition(".")[0]  # of "place.1", the place of a second thing
    if name not in _DESCRIPTION_SLOTS:
        return True
    fillers = plan.values.get(slot.name, ())
    if not fillers:
        return False
    # All fillers of a slot have the same kind and form.
    description = fillers[0]
    if description.kind != "place":
        return True
    return slot.form in (_ANY_FORM, description.form)


def _possible_list_lengths(request: InstructionRequest, scenario: Scenario) -> list[int]:
    """Return how many values the list that a scenario introduces can have: ``[2, 3]``.

    The list holds all values of the goal in its slot, and perhaps others that the scene allows: if
    red is meant in a scene of three colors, it can have 1 to 3 values. Of these numbers, those are
    returned that the scenario asks for, or else the usual ones, 2 and 3.
    """
    slot = scenario.fields.list
    num_in_goal = len(request.values_in(slot))
    if not num_in_goal:  # a slot of another task of the file
        return []
    num_in_scene = num_in_goal + len(_other_values(request, slot))
    wanted = scenario.fields.needs.list or _USUAL_LENGTHS
    return [length for length in wanted if num_in_goal <= length <= num_in_scene]


def _draw_list(request: InstructionRequest, scenario: Scenario) -> Sequence[Filler]:
    """Draw the values that a scenario lists: the goal's among others of the scene, in any order.

    For the goal red it may be *blue, red*. Three draws: the length, the other values, the order.
    """
    slot = scenario.fields.list
    members = list(goal_fillers(request)[slot])
    kind = members[0].kind
    size = request.sampler.pick("list length", _possible_list_lengths(request, scenario))
    choices = list(itertools.permutations(_other_values(request, slot), size - len(members)))
    for other in request.sampler.pick("listed others", choices):
        members.append(Filler(REFERENCE, kind, other))
    return request.sampler.pick("list order", list(itertools.permutations(members)))


def _other_values(request: InstructionRequest, slot: str) -> list[str | int]:
    """Return the values that a slot of the goal could have in the scene, but has not.

    In a scene of red, blue and green cubes with the goal red, ``["blue", "green"]`` for ``color``.
    """
    possible = dict.fromkeys(itertools.chain.from_iterable(request.alternatives(slot)))
    for meant in request.values_in(slot):
        possible.pop(meant.value, None)
    return list(possible)


def fillers_with_rival(request: InstructionRequest, fillers: Fillers) -> Iterator[Fillers]:
    """Yield the fillers of an episode with one value more that is not meant, each time another one.

    Distracting remarks name it, *Blue is out of fashion*. For the goal red, the slot ``rival
    color`` is blue, then green, and so on; values that the list names are left out.

    Args:
        request: the episode.
        fillers: of the slots of its scenario.
    """
    already_named = [value.value for value in fillers.values.get("list", ())]
    already_named += [value.value for value in request.goal_values]
    kinds = {value.slot: value.slot_type for value in request.goal_values}
    for slot, kind in kinds.items():
        for other in _possible_rivals(request, slot):
            if other not in already_named:
                rival = Filler(REFERENCE, kind, other)
                yield fillers.with_values(**{f"rival {slot}": (rival,)})


def _possible_rivals(request: InstructionRequest, slot: str) -> Sequence[str | int]:
    """Return the values of a slot that a distracting remark can name: the goal's may be among them.

    Of colors these are all that the task knows, whether or not they are in the scene; of numbers
    and moments those that other goals of the scene have.
    """
    if slot in COLOR_SLOTS:
        return request.task.things.colors
    return _other_values(request, slot)
