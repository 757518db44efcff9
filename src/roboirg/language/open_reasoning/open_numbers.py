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
from collections.abc import Callable, Collection, Mapping
from typing import NamedTuple

from roboirg.language.instruction import REFERENCE
from roboirg.language.number_words import CARDINALS, cardinal
from roboirg.language.open_reasoning import open_templates as templates
from roboirg.language.patterns.pattern import Derived, Pattern
from roboirg.language.phrases import Phrase, antecedent, fill, listed, plain
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.rivals.rival_templates import NUMBER_PAIRS
from roboirg.language.rivals.value_pair import NUMBER_SLOTS
from roboirg.language.slot_types import Fields, amount
from roboirg.language.slot_types.ordinal import wrapped

COMBINED: Mapping[str, Callable[[int, int], int]] = {
    "total": lambda first, second: first + second,
    "difference": lambda first, second: abs(first - second),
    "larger": max,
    "smaller": min,
}
ROUNDS = 30
"""After which the shares hardly change."""
TICKETS = 400
TICKETS_OF_RESULT = 60
"""Into which the shares of numbers, and of the ways to a result, are rounded."""

PARTIAL = 0.7
"""The factor by which the share of what leads to some choices alone shrinks each time."""

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


Way = tuple[Numbers, int, Calculation]
"""Numbers, what follows from them, and how."""
Tickets = Mapping[Numbers, Mapping[int, tuple[Calculation, ...]]]
"""By numbers and result, each calculation as often as its share."""


@functools.cache
def balanced_ways(choices: tuple[int, ...]) -> tuple[tuple[Numbers, ...], Tickets]:
    """Return numbers as often as they are to be drawn, and then calculations for each result.

    Numbers lead to all choices, the smaller one comes first. The shares are fitted so that numbers
    go with all choices equally often, and a calculation too, as nearly as the numbers allow.
    """
    shares: dict[Way, float] = {}
    for numbers in itertools.combinations(range(1, len(CARDINALS)), 2):
        ways = [(numbers, one, way) for one in choices for way in calculations(numbers, one)]
        if {result for _, result, _ in ways} == set(choices):
            shares |= dict.fromkeys(ways, 1.0)
    for _ in range(ROUNDS):
        for part, mean in ((_calculation, _arithmetic), (_numbers, _geometric)):
            _level(shares, choices, part, mean)
    total = sum(shares.values())
    drawn: list[Numbers] = []
    found: dict[Numbers, dict[int, tuple[Calculation, ...]]] = {}
    for numbers, group in itertools.groupby(shares, _numbers):
        ways = list(group)
        count = round(sum(shares[way] for way in ways) / total * TICKETS)
        drawn += [numbers] * count
        if count:
            found[numbers] = {
                choice: _tickets({way[2]: shares[way] for way in ways if way[1] == choice})
                for choice in choices
            }
    return tuple(drawn), found


def _tickets(shares: Mapping[Calculation, float]) -> tuple[Calculation, ...]:
    total = sum(shares.values())
    return tuple(
        one
        for one, share in shares.items()
        for _ in range(round(share / total * TICKETS_OF_RESULT))
    )


def _level(
    shares: dict[Way, float],
    choices: tuple[int, ...],
    part: Callable[[Way], object],
    mean: Callable[[Collection[float]], float],
) -> None:
    """Scale the shares so that each part of them leads to all choices equally often."""
    sums: dict[object, dict[int, float]] = defaultdict(lambda: dict.fromkeys(choices, 0.0))
    for way, share in shares.items():
        sums[part(way)][way[1]] += share
    for way in shares:
        found = sums[part(way)]
        if found[way[1]]:
            shares[way] *= mean(found.values()) / found[way[1]]
        if not all(found.values()):
            shares[way] *= PARTIAL  # it cannot lead to all of them


def _calculation(way: Way) -> object:
    return way[2]


def _numbers(way: Way) -> Numbers:
    return way[0]


def _arithmetic(values: Collection[float]) -> float:
    return sum(values) / len(values)


def _geometric(values: Collection[float]) -> float:
    return math.prod(values) ** (1 / len(values))


def _goal_value(request: InstructionRequest) -> GoalValue | None:
    """Return the goal's number; None if it has none, or several."""
    found = [one for one in request.goal_values if one.slot in NUMBER_SLOTS]
    return found[0] if len(found) == 1 else None


def _choices(request: InstructionRequest, goal_value: GoalValue) -> tuple[int, ...]:
    found = {number for one in request.alternative_numbers(goal_value.slot) for number in one[:1]}
    return tuple(sorted(found))


def _allows(request: InstructionRequest) -> bool:
    goal_value = _goal_value(request)
    return goal_value is not None and len(_choices(request, goal_value)) > 1


def _derive(request: InstructionRequest) -> Derived:
    goal_value = _goal_value(request)
    assert goal_value is not None  # noqa: S101 - `_allows`
    drawn, tickets = balanced_ways(_choices(request, goal_value))
    numbers = request.sampler.pick("two numbers", drawn)
    calculation = request.sampler.pick("calculation", tickets[numbers][goal_value.number])
    first, second = request.sampler.pick("order of numbers", (numbers, numbers[::-1]))
    named = [antecedent(cardinal(one), REFERENCE, one) for one in (first, second)]
    context = fill(request.pick("two numbers said", NUMBER_PAIRS), {"things": listed(named)})
    notes: dict[str, object] = {
        "patterns": ["number deduction"],
        "relation": f"{calculation.second.name}, {calculation.combination}",
        "reference": [first, second],
    }
    remark = _steps(request, calculation, (first, second))
    return Derived(context, _fields(request, goal_value), notes, remark)


def _steps(request: InstructionRequest, calculation: Calculation, numbers: Numbers) -> Phrase:
    """Return the sentence that calculates; resolved, it names both numbers."""
    both = " and ".join(map(str, numbers))
    words = request.pick("the numbers", templates.NUMBERS)
    resolved = " and ".join(map(cardinal, numbers))
    named = request.refer(words, "them", REFERENCE, both, resolved=resolved)
    template = request.pick("calculation frame", templates.CALCULATIONS)
    for field, pools in (
        ("steps", calculation.second.words),
        ("first", templates.COMBINATIONS[calculation.combination]),
    ):
        (inner,) = pools.of(request.pool)
        template = template.replace(f"{{{field}}}", inner)
    return fill(template, {"numbers": named})


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
