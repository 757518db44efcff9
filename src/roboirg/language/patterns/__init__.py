"""The reasoning patterns by name, each with one rule for every slot type that it can derive."""

from __future__ import annotations

from collections.abc import Mapping

from roboirg.language.patterns import before_after, deduction, exclusion, sequence
from roboirg.language.patterns.pattern import Derived, Pattern
from roboirg.language.request import InstructionRequest

__all__ = ["PATTERNS", "Derived", "Pattern", "find_pattern"]

PATTERNS: Mapping[str, tuple[Pattern, ...]] = {
    "color exclusion": (exclusion.ONE_COLOR,),
    "number deduction": (deduction.TIMES, deduction.AMOUNTS, sequence.COUNTED_VISIT),
    "sequential relation": (sequence.ORDINAL, before_after.NEIGHBOR),
    "contextual logic": (exclusion.TWO_AMOUNTS, before_after.OTHER),
}


def find_pattern(
    name: str,
    request: InstructionRequest,
    patterns: Mapping[str, tuple[Pattern, ...]] = PATTERNS,
) -> Pattern | None:
    """Return the rule by which a pattern derives the episode's goal; None if it cannot."""
    return next((one for one in patterns[name] if one.allows(request)), None)
