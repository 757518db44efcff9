"""Reasoning: the context gives an intermediate reference, from which the goal is derived.

Every task lists its patterns; the episodes cycle through them. A slot that the pattern does not
cover is stated explicitly in the command.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from roboirg.language import templates
from roboirg.language.kinds.number import introduce_quantity
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, sentences
from roboirg.language.request import Draft, Part, Request, Said, SettingRule, other_colours
from roboirg.language.settings.explicit import stated
from roboirg.language.words import cardinal

REFERENCE = "reference"
"""Slot of the mentions that stand for what the goal is derived from, not for the goal."""

BLOCK = 4
"""Difficulties repeat after so many episodes; see `pattern_of`."""


@dataclass(frozen=True, slots=True)
class Pattern:
    """One way to derive a goal.

    Attributes:
        allows: whether an episode can be told this way.
        derive: the introduction, the fields that it covers, and notes.
    """

    allows: Callable[[Request], bool]
    derive: Callable[[Request], tuple[Phrase, dict[str, Phrase], dict[str, object]]]


def pattern_of(request: Request) -> str:
    """The main pattern of an episode.

    The cycle moves on by one more after each block of four episodes: otherwise a task with two
    patterns would use only one of them for its hard episodes.
    """
    names = request.task.commands.patterns
    index = request.episode.index
    turn = index + index // BLOCK
    cycle = [names[(turn + step) % len(names)] for step in range(len(names))]
    return next(name for name in cycle if PATTERNS[name].allows(request))


def say(request: Request) -> Draft:
    """An intermediate reference, and a command that derives the goal from it."""
    pattern = pattern_of(request)
    context, covered, notes = PATTERNS[pattern].derive(request)
    command = request.command(stated(request) | covered)
    said = (Said("introduction", context), Said("command", command))
    return Draft(said, {"pattern": pattern, **notes})


def _exclude(request: Request) -> tuple[Phrase, dict[str, Phrase], dict[str, object]]:
    """The colour that is not among two; a second target is the other one of the two."""
    target, *rest = request.parts_of("colour")
    pair = request.chooser.pick("pair", list(itertools.permutations(other_colours(target.colour))))
    both = " and ".join(pair)
    named = antecedent(both, REFERENCE, both)
    template = request.chooser.pick("pair introduction", templates.PAIR_INTRODUCTIONS)
    context = [fill(template, {"pair": named})]
    word = request.chooser.pick("pair anaphor", templates.PAIR_ANAPHORS)
    reference = named if request.resolved else anaphor(word, "pair", REFERENCE, both)
    exclusion = request.chooser.pick("exclusion", templates.EXCLUSIONS)
    fields = {target.field: request.by_colour(fill(exclusion, {"pair": reference}))}
    patterns = ["colour exclusion"]
    if rest:
        sentence, fields[rest[0].field] = _other_one(request, rest[0], pair, word)
        context.append(sentence)
        patterns.append("contextual logic")
    return sentences(context), fields, {"patterns": patterns}


def _other_one(
    request: Request, part: Part, pair: tuple[str, ...], word: str
) -> tuple[Phrase, Phrase]:
    """A remark that chooses one of the pair, and the command's words for the other one."""
    both = " and ".join(pair)
    chosen = next(colour for colour in pair if colour != part.value)
    remark = request.chooser.pick("singled introduction", templates.SINGLED_INTRODUCTIONS)
    sentence = fill(remark, {"single": antecedent(chosen, REFERENCE, chosen)})
    if request.resolved:
        words = f"the color of {both} that is not {chosen}"
        other = antecedent(words, part.slot, part.value)
    else:
        words = f"the color of {word} that I did not choose"
        other = anaphor(words, "other", part.slot, part.value)
    complement = request.chooser.pick("complement", templates.COMPLEMENTS)
    return sentence, request.by_colour(fill(complement, {"other": other}))


def _relations(result: int) -> list[tuple[templates.Relation, int]]:
    """The relations that give this result, each with its reference quantity."""
    found: list[tuple[templates.Relation, int]] = []
    for relation in templates.RELATIONS:
        reference = relation.reference(result)
        if reference is None or not 1 <= reference <= templates.MAX_REFERENCE:
            continue
        if result not in (reference, relation.spells):
            found.append((relation, reference))
    return found


def _deduce(request: Request) -> tuple[Phrase, dict[str, Phrase], dict[str, object]]:
    """A count by its relation to another quantity."""
    (part,) = request.parts_of("number")
    relation, number = request.chooser.pick("relation", _relations(part.number))
    reference = (
        antecedent(cardinal(number), REFERENCE, number)
        if request.resolved
        else anaphor("that", "that", REFERENCE, number)
    )
    fields = {part.field: fill(relation.times, {"number": reference})}
    notes: dict[str, object] = {
        "patterns": ["number deduction"],
        "relation": relation.name,
        "reference": number,
    }
    return introduce_quantity(request, REFERENCE, number), fields, notes


PATTERNS: Mapping[str, Pattern] = {
    "colour exclusion": Pattern(lambda request: bool(request.parts_of("colour")), _exclude),
    "number deduction": Pattern(
        lambda request: (
            len(request.parts_of("number")) == 1
            and bool(_relations(request.parts_of("number")[0].number))
        ),
        _deduce,
    ),
}

SETTING = SettingRule("reasoning", say)
