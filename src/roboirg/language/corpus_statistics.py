"""What a set of instructions is made of: referring expressions, lengths, patterns, landmarks."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple, cast, get_args

from roboirg.language.instruction import Expression, Instruction


class Lengths(NamedTuple):
    """Words per instruction."""

    mean: float
    shortest: int
    longest: int


Counts = Mapping[str, Mapping[str, int]]
"""By setting, then by what is counted."""


def expressions(instruction: Instruction) -> frozenset[str]:
    """The classes of referring expressions that an instruction contains, each once."""
    return frozenset(
        mention.expression for mention in instruction.mentions if mention.expression is not None
    )


def expression_counts(instructions: Iterable[Instruction]) -> Counts:
    """In how many scenes each expression class occurs, by setting.

    A scene counts once for a setting, however many instructions it has there.
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


def expression_order(counts: Counts) -> tuple[str, ...]:
    """The classes that occur at all, in the order of their definition."""
    found = {name for one in counts.values() for name in one}
    return tuple(name for name in get_args(Expression) if name in found)


def scene_counts(instructions: Iterable[Instruction]) -> Mapping[str, int]:
    """How many scenes there are, by setting."""
    scenes = {(instruction.setting, instruction.episode) for instruction in instructions}
    return Counter(setting for setting, _ in scenes)


def word_counts(instructions: Iterable[Instruction]) -> Mapping[str, Lengths]:
    """Lengths of the prompts in words, by setting."""
    found: dict[str, list[int]] = {}
    for instruction in instructions:
        found.setdefault(instruction.setting, []).append(len(instruction.text.split()))
    return {
        setting: Lengths(statistics.fmean(words), min(words), max(words))
        for setting, words in found.items()
    }


def pattern_counts(instructions: Iterable[Instruction]) -> Counts:
    """How many instructions use each reasoning pattern as their main one, by task."""
    return _tally(instructions, lambda one: _texts(one.metadata.get("pattern")))


def relation_counts(instructions: Iterable[Instruction]) -> Counts:
    """How many instructions use each relation of numbers, by task."""
    return _tally(instructions, lambda one: _texts(one.metadata.get("relation")))


def landmark_counts(instructions: Iterable[Instruction]) -> Counts:
    """How many targets are told by each landmark class, by task."""
    return _tally(instructions, lambda one: _texts(one.metadata.get("landmark_classes")))


def _tally(
    instructions: Iterable[Instruction], values: Callable[[Instruction], Sequence[str]]
) -> Counts:
    counts: dict[str, Counter[str]] = {}
    for instruction in instructions:
        for value in values(instruction):
            counts.setdefault(instruction.task, Counter())[value] += 1
    return counts


def _texts(value: object) -> Sequence[str]:
    if value is None:
        return ()
    values = cast("list[object]", value) if isinstance(value, list) else [value]
    return [str(one) for one in values]
