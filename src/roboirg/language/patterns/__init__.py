"""The reasoning patterns by name, each with one rule for every slot type that it can derive."""

from __future__ import annotations

from collections.abc import Mapping

from roboirg.language.patterns import before_after, complement, deduction, exclusion, sequence
from roboirg.language.patterns.pattern import Pattern

__all__ = ["PATTERNS", "Pattern"]

PATTERNS: Mapping[str, tuple[Pattern, ...]] = {
    "color exclusion": (exclusion.COLOR_LEFT,),
    "number deduction": (deduction.TIMES, deduction.AMOUNTS, sequence.COUNTED),
    "sequential relation": (sequence.ORDINAL, before_after.NEIGHBOR),
    "contextual logic": (exclusion.TWO_AMOUNTS, complement.OTHER_OF_TWO, before_after.OTHER),
}
