"""How many scenes hold each class of referring expressions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import get_args

from roboirg.language.instruction import Expression, Instruction

ClassCounts = Mapping[str, Mapping[str, int]]
"""ClassCounts by group (setting or task), then by class."""


def expressions(instruction: Instruction) -> frozenset[str]:
    """Return the classes of referring expressions in an instruction."""
    return frozenset(
        mention.expression for mention in instruction.mentions if mention.expression is not None
    )


def expression_counts(instructions: Iterable[Instruction]) -> ClassCounts:
    """Count the scenes with each expression class, by setting.

    A scene counts once for a setting, even if it has several instructions there.
    """
    scenes = {
        (instruction.setting, instruction.episode, expression)
        for instruction in instructions
        for expression in expressions(instruction)
    }
    counts: dict[str, Counter[str]] = {}
    for setting, _, expression in sorted(scenes):
        counts.setdefault(setting, Counter())[expression] += 1
    return counts


def expression_order(counts: ClassCounts) -> tuple[str, ...]:
    """Return the classes that occur, in the order of their definition."""
    found = {name for one in counts.values() for name in one}
    return tuple(name for name in get_args(Expression) if name in found)


def scene_counts(instructions: Iterable[Instruction]) -> Mapping[str, int]:
    """Count the scenes by setting."""
    scenes = {(instruction.setting, instruction.episode) for instruction in instructions}
    return Counter(setting for setting, _ in scenes)
