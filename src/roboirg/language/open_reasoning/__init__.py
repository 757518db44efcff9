"""Open reasoning: rules whose words do not give the goal away, alone or one by one."""

from __future__ import annotations

from collections.abc import Mapping

from roboirg.language.open_reasoning import open_colors, open_moments, open_numbers
from roboirg.language.patterns import sequence
from roboirg.language.patterns.pattern import Pattern

OPEN_PATTERNS: Mapping[str, tuple[Pattern, ...]] = {
    "color exclusion": (open_colors.ONE_OF_TWO, open_colors.ONE_OF_THREE),
    "number deduction": (open_numbers.TWO_STEPS,),
    "sequential relation": (sequence.OPEN_ORDINAL,),
    "contextual logic": (open_moments.FAVORITE,),
}
"""Rules whose words alone, or any single one of them, do not give the goal away."""
