"""Contextual logic: of two introduced values, the one that was not taken."""

from __future__ import annotations

from roboirg.language.number_words import cardinal, ordinal, plural
from roboirg.language.patterns.pattern import Derived, Pattern
from roboirg.language.phrases import (
    MentionedValue,
    Phrase,
    anaphor,
    antecedent,
    fill,
    plain,
    sentences,
)
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.rivals.pair_words import (
    INTRODUCTIONS,
    introduced_names,
    pair_noun,
    value_name,
)
from roboirg.language.rivals.value_pair import ValuePair, possible_pairs
from roboirg.language.slot_types import Fields, amount, described
from roboirg.language.slot_types.ordinal import wrapped
from roboirg.language.templates import derivations

_MOMENT = "relation"
"""The slot with a rule of its own, in `before_after`."""


def _pairs(request: InstructionRequest) -> list[ValuePair]:
    return [pair for pair in possible_pairs(request) if not pair.ordered and pair.slot != _MOMENT]


def _drawn(request: InstructionRequest) -> ValuePair:
    pairs = _pairs(request)
    slot = request.sampler.pick("complement slot", list(dict.fromkeys(one.slot for one in pairs)))
    return request.sampler.pick("complement", [one for one in pairs if one.slot == slot])


def _complement(request: InstructionRequest) -> Derived:
    """Derive a value as the other one of two: ``the cube other than that``."""
    pair = _drawn(request)
    order = request.sampler.pick("complement order", ((0, 1), (1, 0)))
    values = (pair[order[0]], pair[order[1]])
    named = [
        antecedent(name, MentionedValue(value.value))
        for name, value in zip(introduced_names(request, pair, values), values, strict=True)
    ]
    template = request.pick("complement introduction", INTRODUCTIONS[pair.word_kind])
    single = antecedent(_single(request, pair), MentionedValue(pair.rival.value))
    remark = request.pick("taken", derivations.TAKEN_REMARKS)
    context = sentences(
        [
            fill(template, {"things": (*named[0], *plain(" and "), *named[1])}),
            fill(remark, {"single": single}),
        ]
    )
    notes: dict[str, object] = {
        "patterns": ["contextual logic"],
        "reference": pair.rival.value,
        "candidates": {pair.slot: [pair[order[0]].value, pair[order[1]].value]},
    }
    return Derived(context, _fields(request, pair, order), notes)


def _single(request: InstructionRequest, pair: ValuePair) -> str:
    """Return the words for the one that is taken: ``the red one``."""
    one = {"color": "one", "amount": "ones"}.get(pair.word_kind)
    return f"the {pair.rival.value} {one}" if one else value_name(request, pair, pair.rival)


def _fields(request: InstructionRequest, pair: ValuePair, order: tuple[int, int]) -> Fields:
    meant, kind = pair.meant, pair.word_kind
    words = _resolved(request, pair, order) if request.resolved else _pointing(request, pair)
    if kind == "color":
        return {meant.field: request.by_color(words)}
    if kind == "amount":
        return described(request, [words])
    if meant.slot == "counts":
        (shade,) = request.color_values
        # The plural fits any number.
        return amount.amounts([(*words, *plain(" of "), *amount.cubes(shade, 2))])
    if kind == "number":
        return {meant.field: words}
    return wrapped(meant, words)


def _pointing(request: InstructionRequest, pair: ValuePair) -> Phrase:
    """Return ``the other visit``."""
    kind = "count" if pair.slot == "counts" else pair.word_kind
    template = request.pick(f"other {kind}", derivations.OTHERS[kind])
    noun = pair_noun(request, pair)
    words = template.format(noun=noun, nouns=plural(noun))
    return anaphor(words, "other", pair.meant)


def _resolved(request: InstructionRequest, pair: ValuePair, order: tuple[int, int]) -> Phrase:
    """Return ``the second or fourth visit but not the second``."""
    short = {value.field: _short_name(pair, value) for value in pair}
    noun = pair_noun(request, pair)
    if pair.word_kind == "amount":
        noun = amount.noun(request.count_of(pair.meant))
    kind = "count" if pair.slot == "counts" else pair.word_kind
    both = [pair[at] for at in order]
    if pair.word_kind not in ("color", "amount"):
        both.sort(key=lambda value: value.number)
    words = derivations.RESOLVED_OTHERS[kind].format(
        both=" or ".join(short[value.field] for value in both),
        left=short[pair.rival.field],
        noun=noun,
    )
    return antecedent(words, pair.meant)


def _short_name(pair: ValuePair, value: GoalValue) -> str:
    if pair.word_kind in ("color", "amount"):
        return value.color
    return (cardinal if pair.word_kind == "number" else ordinal)(value.number)


OTHER_OF_TWO = Pattern(lambda request: bool(_pairs(request)), _complement)
