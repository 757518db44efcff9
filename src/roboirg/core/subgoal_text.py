"""Subgoals in words, perhaps with a point of the front picture: ``pick up the cube at <y, x>``."""

from __future__ import annotations

import re

MOST_SUBGOAL_LETTERS = 300
"""Characters; the policies that follow subgoals truncate after 128 tokens."""
BETWEEN_VERSIONS = " + "
"""Between the versions of a planner and its policy, as one version of both."""
SCRIPTED_HANDS = "scripted hands"
"""Version of the scripted expert where it follows subgoals; rows and pages are marked by it."""
UNKNOWN_WORDS = "these words are no subgoal that the hands know"
"""Why hands refuse words of no known form."""
EMPTY_HAND = "nothing is in the hand"
"""Why hands refuse to put something somewhere."""
_POINT = re.compile(r" at <(\d{1,4}), (\d{1,4})>")

Point = tuple[int, int]
"""Row and column in the front picture."""
_STEPS = re.compile(r" for (\d{1,4}) steps?$")


def split_steps(words: str) -> tuple[str, int | None]:
    """Return words without the number of control steps at their end, and that number.

    ``"hold still for 20 steps"`` -> ``("hold still", 20)``; ``"hold still"`` -> ``("hold still",
    None)``.
    """
    found = _STEPS.search(words)
    if found is None:
        return words, None
    return _STEPS.sub("", words), int(found[1])


def split_point(subgoal: str) -> tuple[str, Point | None]:
    """Return the words of a subgoal without points, and its first point (row, column) or None.

    ``"pick up the cube at <120, 80>"`` -> ``("pick up the cube", (120, 80))``.
    """
    found = _POINT.search(subgoal)
    if found is None:
        return subgoal, None
    point = (int(found[1]), int(found[2]))
    return _POINT.sub("", subgoal), point
