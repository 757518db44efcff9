"""Statistics of instructions: referring expressions, lengths, patterns, landmarks."""

from __future__ import annotations

import re
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
    """Return the sizes of the prompts by setting, in words for example; settings in their order."""
    found: dict[str, list[int]] = {name: [] for name in setting_names()}
    for instruction in instructions:
        found[instruction.setting].append(size_of(instruction.text))
    return {setting: sizes for setting, sizes in found.items() if sizes}


def expression_counts(instructions: Iterable[Instruction]) -> ClassCounts:
    """Count the scenes with each expression class, by setting.

    A scene counts once for a setting, even if it has several instructions there.
    """
    scenes = {
        (instruction.setting, instruction.episode, mention.expression)
        for instruction in instructions
        for mention in instruction.mentions
        if mention.expression is not None
    }
    counts: dict[str, Counter[str]] = {}
    for setting, _, expression in sorted(scenes):
        counts.setdefault(setting, Counter())[expression] += 1
    return counts


def expression_order(counts: ClassCounts) -> tuple[str, ...]:
    """Return the classes that occur, in the order of their definition."""
    found = {name for one in counts.values() for name in one}
    return tuple(name for name in get_args(Expression) if name in found)


PAPER_PHRASES: Mapping[str, tuple[tuple[str, str], ...]] = {
    "direct": (
        ("it", "it"), ("one of them", "one of them"), ("them", "them"),
        ("the former", "the former"), ("the latter", "the latter"),
        ("the first", "the first"), ("the second", "the second"), ("the third", "the third"),
        ("that", "that"), ("the one I mentioned earlier", "the one i mentioned earlier"),
    ),
    "reasoning": (
        ("neither of those", "neither of (?:those|these)"),
        ("whose color is not in that pair", "not in that pair"),
        ("different from that", "different from that"),
        ("one time fewer than that", "one time fewer than that"), ("the action", "the action"),
        ("before", "before"), ("after", "after"), ("other than that", "other than that"),
        ("the other one", "the other (?:one|cube|visit|placement|moment|number)"),
    ),
    "contextual": (("the one I mentioned earlier", "the one i mentioned earlier"),),
    "spatial": (
        ("the cube there", "(?:the|that) cube (?:over )?there"),
        ("the one there", "(?:the|that) one (?:over )?there"),
    ),
}  # fmt: skip
"""Phrases that the paper quotes or lists, by setting, each with its pattern in our commands."""
RESOLVED_PHRASES = (("at the far right", "at your far right"), ("different from blue",
                    "different from (?:red|green|blue|purple|yellow|gray)"))  # fmt: skip
"""The same of resolved commands."""


def phrase_counts(instructions: Iterable[Instruction]) -> ClassCounts:
    """Count the commands of each setting that have a phrase of the paper."""
    counts: dict[str, Counter[str]] = {}
    for instruction in instructions:
        implicit = instruction.form == "implicit"
        phrases = PAPER_PHRASES.get(instruction.setting, ()) if implicit else RESOLVED_PHRASES
        name = instruction.setting if implicit else f"{instruction.setting}, resolved"
        text = instruction.command.lower()
        for phrase, pattern in phrases:
            found = re.search(rf"\b{pattern}\b", text) is not None
            counts.setdefault(name, Counter()).update([phrase] * found)
    return counts


def metadata_counts(instructions: Iterable[Instruction], name: str) -> ClassCounts:
    """Count the values of an entry of the metadata by task; each value of a list counts."""
    counts: dict[str, Counter[str]] = {}
    for instruction in instructions:
        value = instruction.metadata.get(name)
        for one in value if isinstance(value, list) else [value]:
            if one is not None:
                counts.setdefault(instruction.task, Counter())[str(one)] += 1
    return counts
