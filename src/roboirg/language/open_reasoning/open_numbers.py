"""Open number deduction: two numbers, and a calculation that leads from them to the goal's.

The numbers are drawn without the goal, among those from which calculations lead to every number of
the scene. So they say nothing about the goal, and as far as possible neither does a calculation
without its numbers.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections import defaultdict
from collections.abc import Mapping
from typing import NamedTuple

from roboirg.language.instruction import REFERENCE
from roboirg.language.number_words import CARDINALS, cardinal
from roboirg.language.open_reasoning import open_templates as templates
from roboirg.language.patterns.pattern import Derived, Pattern
from roboirg.language.phrases import Phrase, anaphor, antecedent, fill, plain
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.slot_types import Fields, amount
from roboirg.language.slot_types.ordinal import wrapped

NUMBER_SLOTS = ("repeats", "counts", "visit", "placement")
COMBINED = {
    "total": lambda first, second: first + second,
    "difference": lambda first, second: abs(first - second),
    "larger": max,
    "smaller": min,
}
ROUNDS = 40
"""After which the shares of the calculations change no more."""
TICKETS = 48
"""Into which the share of a calculation is rounded."""

Numbers = tuple[int, int]


class Calculation(NamedTuple):
    """Two steps from two numbers to a result."""

    combination: str
    second: templates.SecondStep


def calculations(numbers: Numbers, result: int) -> list[Calculation]:
    """Return all calculations that lead from two numbers to a result."""
    return [
        Calculation(name, step)
        for (name, combine), step in itertools.product(COMBINED.items(), templates.SECOND_STEPS)
        if step.result(combine(*numbers)) == result
    ]


@functools.cache
def balanced_calculations(
    choices: tuple[int, ...],
) -> Mapping[tuple[Numbers, int], tuple[Calculation, ...]]:
    """Return calculations for numbers and results, as often as each is to be drawn.

    Only numbers, the smaller one first, that lead to all choices. The shares are fitted so that a
    calculation leads to each of the choices equally often, as far as the numbers allow.
    """
    ways: dict[tuple[Numbers, int], list[Calculation]] = {}
    for numbers in itertools.combinations(range(1, len(CARDINALS)), 2):
        found = {(numbers, result): calculations(numbers, result) for result in choices}
        if all(found.values()):
            ways |= found
    shares = {key: dict.fromkeys(found, 1 / len(found)) for key, found in ways.items()}
    for _ in range(ROUNDS):
        sums: dict[Calculation, dict[int, float]] = defaultdict(lambda: dict.fromkeys(choices, 0.0))
        for (_, result), share in shares.items():
            for one, part in share.items():
                sums[one][result] += part
        for (_, result), share in shares.items():
            for one in share:
                mean = sum(sums[one].values()) / len(choices)
                share[one] *= math.sqrt(mean / sums[one][result]) if sums[one][result] else 0.0
            total = sum(share.values())
            share.update({one: part / total for one, part in share.items()})
    return {
        key: tuple(
            one for one, part in share.items() for _ in range(math.ceil(part * TICKETS - 0.5))
        )
        for key, share in shares.items()
    }


def _goal_value(request: InstructionRequest) -> GoalValue | None:
    """Return the goal's number; None if it has none, or several."""
    found = [one for one in request.goal_values if one.slot in NUMBER_SLOTS]
    return found[0] if len(found) == 1 else None


def _balanced(
    request: InstructionRequest, goal_value: GoalValue
) -> Mapping[tuple[Numbers, int], tuple[Calculation, ...]]:
    numbers = {number for one in request.alternative_numbers(goal_value.slot) for number in one[:1]}
    return balanced_calculations(tuple(sorted(numbers))) if len(numbers) > 1 else {}


def _allows(request: InstructionRequest) -> bool:
    goal_value = _goal_value(request)
    return goal_value is not None and bool(_balanced(request, goal_value))


def _derive(request: InstructionRequest) -> Derived:
    goal_value = _goal_value(request)
    assert goal_value is not None  # noqa: S101 - `_allows`
    ways = _balanced(request, goal_value)
    numbers = request.sampler.pick("two numbers", sorted({numbers for numbers, _ in ways}))
    calculation = request.sampler.pick("calculation", ways[numbers, goal_value.number])
    first, second = request.sampler.pick("order of numbers", (numbers, numbers[::-1]))
    context = fill(
        request.pick("two quantities", templates.TWO_QUANTITIES),
        {
            "first": antecedent(cardinal(first), REFERENCE, first),
            "second": antecedent(cardinal(second), REFERENCE, second),
        },
    )
    notes: dict[str, object] = {
        "patterns": ["number deduction"],
        "relation": f"{calculation.second.name}, {calculation.combination}",
        "reference": [first, second],
    }
    remark = _steps(request, calculation, f"{cardinal(first)} and {cardinal(second)}")
    return Derived(context, _fields(request, goal_value), notes, remark)


def _steps(request: InstructionRequest, calculation: Calculation, both: str) -> Phrase:
    """Return the sentence that calculates; resolved, it names both numbers."""
    words = request.pick("the numbers", templates.NUMBERS)
    numbers = (
        antecedent(both, REFERENCE, both)
        if request.resolved
        else anaphor(words, "them", REFERENCE, both)
    )
    template = request.pick("calculation frame", templates.CALCULATIONS)
    for field, pools in (
        ("steps", calculation.second.words),
        ("first", templates.COMBINATIONS[calculation.combination]),
    ):
        (inner,) = pools.of(request.pool)
        template = template.replace(f"{{{field}}}", inner)
    return fill(template, {"numbers": numbers})


def _fields(request: InstructionRequest, goal_value: GoalValue) -> Fields:
    """Return ``that many times``, ``that many red cubes``, ``the visit with that number``.

    These point at the sentence before, in the same command, so they are no mentions.
    """
    if goal_value.slot == "counts":
        (color,) = request.color_values
        # The plural fits any number.
        return amount.amounts([amount.amount(plain("that many"), amount.cubes(color, 2))])
    if goal_value.slot == "repeats":
        return {goal_value.field: plain(request.pick("that many times", templates.THAT_MANY))}
    return wrapped(request, goal_value, plain(f"the {goal_value.slot_type} with that number"))


TWO_STEPS = Pattern(_allows, _derive)
