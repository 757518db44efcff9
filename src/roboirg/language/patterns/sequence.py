"""Sequential relation: an element of a series by its distance from another one."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.language import templates
from roboirg.language.number_words import ordinal as ordinal_word
from roboirg.language.patterns.pattern import REFERENCE, Derived, Pattern
from roboirg.language.phrases import anaphor, antecedent, fill, plain
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types import ordinal


def steps(position: int, length: int, choices: Sequence[int]) -> list[templates.Step]:
    """The steps that lead to a position from another one of a series of this length.

    Args:
        position: the goal's.
        length: of the series.
        choices: positions that somebody could want; a step that leads to only one of them would
            give it away.
    """
    if length == 2:  # noqa: PLR2004
        # Of two, the one right after another can only be the last: they are neighbors instead.
        return [templates.NEIGHBORS[position]]
    return [
        step
        for step in templates.STEPS
        if step.spells != position
        and _leads(step, position, length)
        and sum(_leads(step, choice, length) for choice in choices) > 1
    ]


def _leads(step: templates.Step, position: int, length: int) -> bool:
    return 1 <= position - step.offset <= length


def _steps(request: InstructionRequest, part: GoalValue) -> list[templates.Step]:
    length = ordinal.series_length(request, part)
    choices = [number for (number,) in request.numbers_instead(part.slot)]
    return steps(part.number, length, choices)


def _part(request: InstructionRequest) -> GoalValue | None:
    return next(iter((*request.parts_of("visit"), *request.parts_of("placement"))), None)


def _allows(request: InstructionRequest) -> bool:
    part = _part(request)
    return part is not None and bool(_steps(request, part))


def _derive(request: InstructionRequest) -> Derived:
    (part,) = (*request.parts_of("visit"), *request.parts_of("placement"))
    step = request.chooser.pick("relation", _steps(request, part))
    position = part.number - step.offset
    reference = (
        antecedent(f"the {ordinal_word(position)}", REFERENCE, position)
        if request.resolved
        else anaphor("that", "that", REFERENCE, position)
    )
    which = (*plain(f"the {part.kind} "), *fill(step.words, {"reference": reference}))
    notes: dict[str, object] = {
        "patterns": ["sequential relation"],
        "relation": step.name,
        "reference": position,
    }
    context = ordinal.introduce_position(request, part, REFERENCE, position)
    return Derived(context, ordinal.wrapped(part, which), notes)


ORDINAL = Pattern(_allows, _derive)
