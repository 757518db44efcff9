"""The reasoning patterns by name; a pattern has a way for each kind of value that it can derive."""

from __future__ import annotations

from collections.abc import Mapping

from roboirg.language.patterns import before_after, deduction, exclusion, sequence
from roboirg.language.patterns.pattern import REFERENCE, Derived, Pattern
from roboirg.language.request import InstructionRequest

__all__ = ["PATTERNS", "REFERENCE", "Derived", "Pattern", "way"]

PATTERNS: Mapping[str, tuple[Pattern, ...]] = {
    "color exclusion": (exclusion.ONE_COLOR,),
    "number deduction": (deduction.TIMES, deduction.AMOUNTS, deduction.VISIT),
    "sequential relation": (sequence.ORDINAL, before_after.NEIGHBOR),
    "contextual logic": (exclusion.TWO_AMOUNTS, before_after.OTHER),
}


def way(name: str, request: InstructionRequest) -> Pattern | None:
    """How a pattern derives the episode's goal, or None if it cannot."""
    return next((one for one in PATTERNS[name] if one.allows(request)), None)
