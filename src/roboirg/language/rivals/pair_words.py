"""The words for a pair: its introduction, the remark that chooses, and the command."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from roboirg.core.word_pools import Pools
from roboirg.language.instruction import Expression
from roboirg.language.number_words import cardinal, ordinal, plural
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, plain, sentences
from roboirg.language.request import GoalValue, InstructionRequest, UtteranceSpec
from roboirg.language.rivals import rival_templates as templates
from roboirg.language.rivals.pair_draw import PairDraw
from roboirg.language.rivals.value_pair import ValuePair
from roboirg.language.slot_types import Fields, amount, described, relation, stated
from roboirg.language.slot_types.ordinal import wrapped
from roboirg.language.templates.derivations import MOMENTS

INTRODUCTIONS: Mapping[str, Pools[str]] = {
    "color": templates.THING_PAIRS,
    "amount": templates.THING_PAIRS,
    "number": templates.NUMBER_PAIRS,
    "visit": templates.ELEMENT_PAIRS,
    "placement": templates.ELEMENT_PAIRS,
    "relation": templates.MOMENT_PAIRS,
}
_POINTER_CLASSES: tuple[Expression, ...] = ("former", "latter", "first", "second", "last")


def pair_introduction(request: InstructionRequest, draw: PairDraw) -> UtteranceSpec:
    """Return a sentence that names both values on equal terms."""
    names = introduced_names(request, draw.pair, draw.introduced)
    first, second = (
        antecedent(name, value) for name, value in zip(names, draw.introduced, strict=True)
    )
    pools = INTRODUCTIONS[draw.pair.word_kind]
    template = request.pick("pair introduction of rivals", pools)
    words = fill(template, {"things": (*first, *plain(" and "), *second)})
    return UtteranceSpec("introduction", words)


def pair_command(request: InstructionRequest, draw: PairDraw) -> UtteranceSpec:
    """Return the remark that chooses, and a command that states the other slots."""
    remark = _choosing_remark(request, draw)
    fields = stated(request)
    if draw.pair.slot == "counts":
        fields |= _counted(request, draw)
    elif not request.resolved:
        fields |= _chosen_fields(request, draw)
    return UtteranceSpec("command", sentences([remark, request.command(fields)]))


def _choosing_remark(request: InstructionRequest, draw: PairDraw) -> Phrase:
    """Return the remark that chooses one value; resolved, both have their names."""
    thing = pair_noun(request, draw.pair)
    meant, rival = draw.pair
    at_meant = draw.fill == "both" or draw.points_at_meant
    at_rival = draw.fill == "both" or not draw.points_at_meant
    words = {
        "yes": _pointer(draw, meant, thing, points=at_meant),
        "no": _pointer(draw, rival, thing, points=at_rival),
    }
    if request.resolved:
        words = {
            field: antecedent(value_name(request, draw.pair, value), value)
            for field, value in (("yes", meant), ("no", rival))
        }
    return fill(draw.text, words)


def _chosen(request: InstructionRequest, draw: PairDraw, words: str) -> Phrase:
    """Return ``the cube I mean`` for a noun phrase such as ``the cube``."""
    clause = request.pick("rival clause", templates.CLAUSES)
    return anaphor(f"{words} {clause}", "choice", draw.pair.meant)


def _the_other(value: GoalValue, words: str) -> Phrase:
    """Return words for the value that is not meant."""
    return anaphor(words, "other", value)


def pair_notes(draw: PairDraw) -> dict[str, object]:
    """Return the entries of the metadata."""
    values = [value.value for value in draw.introduced]
    return {
        "rival": draw.pair.rival.value,
        "rival_slot": draw.pair.slot,
        "rival_position": "second" if draw.meant_first else "first",
        "rival_reference": draw.kind,
        "candidates": {draw.pair.slot: values},
    }


def pair_noun(request: InstructionRequest, pair: ValuePair) -> str:
    """Return the noun for what the values are: ``cube``, ``number``, ``visit``."""
    if pair.word_kind == "amount":
        return "cubes"
    if pair.word_kind == "color":
        return request.task.commands.colored
    return {"relation": "moment"}.get(pair.word_kind, pair.word_kind)


def value_name(request: InstructionRequest, pair: ValuePair, value: GoalValue) -> str:
    """Return the full words for one of the values: ``the red cube``."""
    kind = pair.word_kind
    if kind in ("color", "amount"):
        return f"the {value.value} {pair_noun(request, pair)}"
    if kind == "number":
        return cardinal(value.number)
    if kind == "relation":
        return f"the moment {MOMENTS[str(value.value)]}"
    return f"the {ordinal(value.number)} {kind}"


def _pointer(draw: PairDraw, value: GoalValue, thing: str, *, points: bool) -> Phrase:
    several = thing == "cubes"
    if not points:
        if draw.pair.word_kind in ("color", "amount"):
            thing = "ones" if several else "one"
        return _the_other(value, f"the other {thing}")
    first, second, first_many, second_many = draw.pointers
    if several:
        first, second = first_many, second_many
    words = first if value is draw.introduced[0] else second
    found = next(one for one in _POINTER_CLASSES if one in words.split())
    return anaphor(words, found, value)


def introduced_names(
    request: InstructionRequest, pair: ValuePair, values: Sequence[GoalValue]
) -> tuple[str, str]:
    """Return ``the red`` and ``green cubes``: the second one of two has the noun for both."""
    first, second = values
    kind = pair.word_kind
    if kind == "number":
        return cardinal(first.number), cardinal(second.number)
    if kind == "relation":
        return f"right {first.value}", MOMENTS[str(second.value)]
    short = [one.color if kind in ("color", "amount") else ordinal(one.number) for one in values]
    return f"the {short[0]}", f"{short[1]} {plural(pair_noun(request, pair).removesuffix('s'))}"


def _chosen_fields(request: InstructionRequest, draw: PairDraw) -> Fields:
    """Return the fields of the command that point at the choice."""
    kind, (meant, rival) = draw.pair.word_kind, draw.pair
    if kind == "color":
        words = _chosen(request, draw, f"the {pair_noun(request, draw.pair)}")
        fields = {meant.field: request.by_color(words)}
        if draw.pair.ordered:
            fields[rival.field] = request.by_color(_the_other(rival, "the other one"))
        return fields
    if kind == "amount":
        words = _chosen(request, draw, f"of the {pair_noun(request, draw.pair)}")
        return described(request, [words])
    if kind == "number":
        return {meant.field: _chosen(request, draw, "the number of times")}
    if kind == "relation":
        return relation.placed(meant, _chosen(request, draw, "at the moment"))
    return wrapped(meant, _chosen(request, draw, f"the {meant.slot_type}"))


def _counted(request: InstructionRequest, draw: PairDraw) -> Fields:
    """Return ``the right number of red cubes``; resolved, ``two red cubes``."""
    meant, (color,) = draw.pair.meant, request.color_values
    words = request.pick("rival number", templates.NUMBERS_OF)
    named = cardinal(meant.number)
    number = request.refer(words, "choice", meant, resolved=named)
    # The plural fits any number that is not named.
    count = meant.number if request.resolved else 2
    return amount.amounts([amount.amount(number, amount.cubes(color, count))])
