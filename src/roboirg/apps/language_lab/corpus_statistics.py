"""Statistics of instructions: referring expressions, lengths, patterns, landmarks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import get_args

from roboirg.language.instruction import Expression, Instruction
from roboirg.language.settings import setting_names

ClassCounts = Mapping[str, Mapping[str, int]]
"""Counts by group (setting or task), then by class."""


def by_setting(
    instructions: Iterable[Instruction], size_of: Callable[[str], int]
) -> dict[str, list[int]]:
    """Return the size of each prompt by setting, such as ``{"direct": [18, 23]}``.

    Settings are in their usual order; those without instructions are left out.

    Args:
        instructions: whose texts are the prompts.
        size_of: returns the size of a text, for example its number of words.
    """
    found: dict[str, list[int]] = {name: [] for name in setting_names()}
    for instruction in instructions:
        found[instruction.setting].append(size_of(instruction.text))
    return {setting: sizes for setting, sizes in found.items() if sizes}


def expression_counts(instructions: Iterable[Instruction]) -> ClassCounts:
    """Return in how many scenes each class of referring expression occurs, by setting.

    For example ``{"direct": {"it": 50}}``: in 50 scenes, the text in ``direct`` refers back with
    *it*. A scene counts once for a setting, even if it has several instructions there.
    """
    scenes: set[tuple[str, str, str]] = set()
    for instruction in instructions:
        for mention in instruction.mentions:
            if mention.expression is not None:
                scenes.add((instruction.setting, instruction.episode, mention.expression))
    counts: dict[str, Counter[str]] = {}
    for setting, _, expression in sorted(scenes):
        counts.setdefault(setting, Counter())[expression] += 1
    return counts


def expression_order(counts: ClassCounts) -> tuple[str, ...]:
    """Return the classes of referring expressions that have counts, as `Expression` orders."""
    found = classes_in(counts)
    return tuple(name for name in get_args(Expression) if name in found)


def classes_in(counts: ClassCounts) -> set[str]:
    """Return all classes with a count in any group: ``{"direct": {"it": 50}}`` has ``{"it"}``."""
    found: set[str] = set()
    for by_class in counts.values():
        found.update(by_class)
    return found


def metadata_counts(instructions: Iterable[Instruction], name: str) -> ClassCounts:
    """Return how often each value of an entry of the instructions' metadata occurs, by task.

    For the entry ``relation``: ``{"StopCube": {"one later": 7}}``. If an entry is a list, each of
    its values counts; None does not, and instructions without the entry do not.
    """
    counts: dict[str, Counter[str]] = {}
    for instruction in instructions:
        entry = instruction.metadata.get(name)
        values = entry if isinstance(entry, list) else [entry]
        for value in values:
            if value is not None:
                counts.setdefault(instruction.task, Counter())[str(value)] += 1
    return counts
