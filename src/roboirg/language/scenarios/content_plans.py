"""Content plans: the ways to say a goal without naming it in the command, by setting.

- *content plan*: which fields of the command are pronouns, and what the introduction names so that
  they can be resolved: *The cube on the left is wet. Lift it.* Scenarios put it into words.
- *place*: where a thing stands; *clue*: what only who sees the scene or the video can know.
- *form*: how a place is said: as a ``spot``, *the table wobbles on the left*, or, None, after a
  noun, *the cube all the way on the left*.
- *notes*: what the metadata of the instruction say of the plan.

The purposes of draws, such as ``spot class-color``, are hash keys: another spelling, or another
order of the options, draws other words.
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
    pairs_of_drawn_slot,
)
from roboirg.language.scenarios.derived import derivations_of
from roboirg.language.scenarios.fillers import (
    ANY_LIST,
    ContentPlan,
    Filler,
    FillersBySlot,
    filler_of,
    goal_fillers,
    list_fillers,
)
from roboirg.language.settings.grounded import draw_clues


def _direct_plans(request: InstructionRequest) -> Iterator[ContentPlan]:
    """Yield a content plan for every choice of command fields that can be pronouns.

    For a goal of ``color`` and ``repeats``: only the color, *Lift it twice*, only the repeats, and
    both. The introduction names the values themselves, so the plans add nothing to name.
    """
    fields = [value.field for value in request.goal_values]
    for size in range(1, len(fields) + 1):
        for pronoun_fields in itertools.combinations(fields, size):
            yield ContentPlan(pronoun_fields, {}, {}, ANY_LIST)


def _spatial_plans(request: InstructionRequest) -> Iterator[ContentPlan]:
    """Yield the content plan in which the introduction names a place instead of a color.

    *It's dusty on the left. Lift the cube there.* Places are drawn. One plan is yielded, with a
    place as a spot, *on the left*, or, where there is none, with one after a noun, *the cube
    nearest to the button*. For goals that count cubes of colors both are yielded, as scenarios may
    say either; their other colors are named.
    """
    has_amounts = bool(request.values_of("amount"))
    for form in ("spot", None):  # None: words after a noun
        places = _draw_places(request, form)
        if not places:
            continue
        # Of two things only that with the shorter words has a place.
        number = min(places, key=lambda at: len(places[at].said(form)))
        plan = _plan_by_place(request, number, places[number], form)
        if not has_amounts:
            yield plan
            return
        yield _with_others_stated(request, request.color_values[number], plan)


def _plan_by_place(
    request: InstructionRequest, at: int, place: SpokenPlace, form: str | None
) -> ContentPlan:
    """Return the content plan that names a place instead of a color of the goal.

    For the goal *red*, whose cube is on the left: every color of the command becomes a pronoun, and
    a filler with the words *on the left*, which mean red, goes into the slots ``place`` and
    ``place.0``, as sentences of scenarios have either. *It's dusty on the left. Lift the cube
    there.*

    Args:
        request: the episode.
        at: index of the color among those of the goal, 0 or 1, and number of the second slot.
        place: where a thing of this color stands.
        form: how the place is said: ``spot``, *on the left*, or None, after a noun, *all the way on
            the left*.
    """
    color = request.color_values[at]
    words = place.said(form)
    fillers = (Filler(color.slot, "place", color.value, words, form),)
    notes: dict[str, object] = {
        "landmarks": [words],
        "landmark_classes": [int(place.kind)],
        "frame": request.frame,
    }
    pronoun_fields = [value.field for value in request.color_values]
    return ContentPlan(pronoun_fields, {"place": fillers, f"place.{at}": fillers}, notes)


def _with_others_stated(
    request: InstructionRequest, described: GoalValue, plan: ContentPlan
) -> ContentPlan:
    """Return a content plan, changed for a goal that counts cubes: *2 red and 1 blue*.

    Only one color, which the plan describes, is a pronoun in the command; it becomes the first one,
    ``colors.0``. All other colors and the counts are named.

    Args:
        request: the episode.
        described: the color that the plan describes, by a place or a clue.
        plan: as it is for a goal without counts.
    """
    values = goal_fillers(request, request.color_values.index(described))
    return plan._replace(fields=["colors.0"], values={**values, **plan.values})


def _draw_places(request: InstructionRequest, form: str | None) -> dict[int, SpokenPlace]:
    """Draw a place for each color of the goal that has one, by the color's index.

    For the goal red and blue it may be ``{0: on the left, 1: next to the button}``. The class of a
    place is drawn first, or most places would be of the most frequent class. `form` is how places
    are said: ``spot``, or None for after a noun.
    """
    found = {}
    for index, color in enumerate(request.color_values):
        places = _sayable_places(request, color, form)
        if places:
            kinds = list(dict.fromkeys(place.kind for place in places))
            kind = request.sampler.pick(f"{form} class-{color.field}", kinds)
            of_kind = [place for place in places if place.kind == kind]
            found[index] = request.sampler.pick(f"{form} place-{color.field}", of_kind)
    return found


def _sayable_places(
    request: InstructionRequest, color: GoalValue, form: str | None
) -> list[SpokenPlace]:
    """Return the places of the things of a color that have words in a form, best words first.

    Unusual words, *third closest to you*, are returned only if there are no others, and only the
    first of them. `form` is ``spot``, or None for words after a noun.
    """
    things = request.objects_to_point_at(color)
    places = spoken_places(request.episode.scene, request.task.things.pointed, request.frame)
    known = [place for place in places if place.thing in things and place.said(form)]
    usual = [place for place in known if place.kind < PlaceClass.UNUSUAL]
    return usual or known[:1]


def _grounded_plans(request: InstructionRequest) -> Iterator[ContentPlan]:
    """Yield the content plan in which the introduction says what only the scene or video shows.

    *The cube in the middle is wet. Lift it.* Such words are a clue. The slot of the goal that they
    stand for is drawn; nothing is yielded if no value has a clue.
    """
    clues = draw_clues(request)
    if not clues:
        return
    slots = list(dict.fromkeys(value.slot for value in clues))
    slot = request.sampler.pick("seen slot", slots)
    # Of two things only that with the shorter words is described.
    values_of_slot = [value for value in clues if value.slot == slot]
    described_value = min(values_of_slot, key=lambda value: len(clues[value].words))
    yield _plan_by_clue(request, described_value, clues[described_value])


def _plan_by_clue(request: InstructionRequest, value: GoalValue, clue: Clue) -> ContentPlan:
    """Return the content plan that says a clue, words for what is seen, instead of a goal's value.

    *The cube in the middle* stands for its color. The clue *all but three* stands for a number of
    cubes, and with it for their color, the only one in the scene.
    """
    notes = {"touched": [value.slot], "pattern": clue.kind, "patterns": [clue.kind]}
    if value.slot == "counts":  # "all but three"
        kept = (Filler(REFERENCE, "number", CUBES_LEFT_OVER),)
        return ContentPlan(["colors.0", "counts.0"], {"kept": kept}, notes)
    fields = [value.field for value in request.values_in(value.slot)]
    plan = ContentPlan(fields, _fillers_of_clue(value, clue), notes)
    if request.values_of("amount"):
        return _with_others_stated(request, value, plan)
    return plan


def _fillers_of_clue(value: GoalValue, clue: Clue) -> FillersBySlot:
    """Return a clue, words for what is seen that stand for a goal's value, as fillers by slot.

    ==========================================================  ====================================
    *the cube in the middle*                                    ``clue``, ``counted``
    *red cubes to the left of the cube from the video*          ``beside``, ``counted``
    *on the left* and *next to the button*, both set aside      ``aside.0``, ``aside.1``, ``rest``
    ==========================================================  ====================================

    ``counted`` has the words of a number, *once for each red cube …*, and ``rest`` is the thing
    that is left when two are set aside.
    """
    if clue.aside:
        aside = [Filler("", "place", place, place) for place in clue.aside]
        rest = Filler(value.slot, "clue", value.value, "one")
        return {"rest": (rest,), **list_fillers("aside", aside)}
    seen = Filler(value.slot, "clue", value.value, clue.words)
    counted = Filler(value.slot, "clue", value.value, clue.short)
    if clue.kind == "counts":
        return {"beside": (seen,), "counted": (counted,)}
    _, _, number = value.field.partition(".")
    return {"clue": (seen,), f"clue.{number}": (seen,), "counted": (counted,)}


def _rival_plans(request: InstructionRequest) -> Iterator[ContentPlan]:
    """Yield the content plan that names two values, of which words before the command choose one.

    *Red or blue? Let's skip the former. Lift that one.* The goal's value is one of the two. The
    other one, its rival, and the order of the two are drawn, so that each of two values is meant,
    and each position, equally often. The episode must have a rival (`pair_refusal`).
    """
    pair = balanced_rival(request, pairs_of_drawn_slot(request))
    order = draw_order(request)
    meant = filler_of(pair.meant)
    rival = Filler(pair.rival.slot, pair.meant.slot_type, pair.rival.value)
    both = [meant, rival] if order.is_meant_first else [rival, meant]
    values = {**list_fillers("list", both), "taken": (rival,)}
    notes = _rival_notes(pair, order)
    yield ContentPlan(_rival_fields(pair), values, notes, pair.slot, _remark_name(order))


def _rival_notes(pair: ValuePair, order: PairOrder) -> dict[str, object]:
    """Return the metadata entries about a goal's value and its rival, which is named next to it.

    For *red* before its rival *blue*: ``"rival": "blue", "rival_position": "second"`` and others.
    """
    candidates = [value.value for value in pair]
    if not order.is_meant_first:
        candidates.reverse()
    return {
        "rival": pair.rival.value,
        "rival_slot": pair.slot,
        "rival_position": "second" if order.is_meant_first else "first",
        "rival_reference": _remark_name(order),
        "candidates": {pair.slot: candidates},
    }


def _remark_name(order: PairOrder) -> str:
    """Return the name of the remark that chooses the meant one of two values: ``not_former``.

    If the meant value is said second, a remark either points at it, ``latter``, or sets the first
    one aside, ``not_former``; if it is said first, ``former`` or ``not_latter``. Scenarios have the
    words under these names: ``remarks.not_former``.
    """
    meant_rank = "former" if order.is_meant_first else "latter"
    rival_rank = "latter" if order.is_meant_first else "former"
    return meant_rank if order.points_at_meant else f"not_{rival_rank}"


def _rival_fields(pair: ValuePair) -> list[str]:
    """Return the fields of the command that are pronouns if a value and its rival are named.

    One field, ``["color"]``. Both fields of two colors whose order is open, and for a number of
    cubes also their color.
    """
    if pair.is_ordered:
        return [pair.meant.field, pair.rival.field]
    if pair.slot == "counts":
        return [pair.meant.field, "colors.0"]  # the only color, at which the words point, too
    return [pair.meant.field]


CONTENT_PLANNERS: Mapping[str, Callable[[InstructionRequest], Iterable[ContentPlan]]] = {
    "direct": _direct_plans,
    "reasoning": derivations_of,
    "spatial": _spatial_plans,
    "grounded": _grounded_plans,
    "direct-rival": _rival_plans,
}
"""What yields the content plans of an episode, by the name of a setting of ours; explicit has none,
and contextual those of direct."""
