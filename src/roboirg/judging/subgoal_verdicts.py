"""Whether a planner's subgoal is what the due stage asks for."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Literal, get_args

from roboirg.core.episode import Stage
from roboirg.core.subgoal_text import split_point, split_steps
from roboirg.judging.judge import plain_subgoal

SubgoalVerdict = Literal["right", "wrong_thing", "wrong_place", "wrong_count", "lost"]
"""The subgoal is what is due; names or points at another thing; another place for the right thing;
the right act for another time or in another order; or an act that is not due."""
SUBGOAL_VERDICTS: tuple[SubgoalVerdict, ...] = get_args(SubgoalVerdict)

_ORDINAL = re.compile(
    r"\s*(?:for the )?\b(?:first|second|third|fourth|fifth|sixth|\d+(?:st|nd|rd|th))\b(?: time)?"
)
_PLACING = re.compile(r"(?P<act>put(?! down)|place|move) (?P<thing>.*?) ?\b(?:onto|into|on|of)\b")


def judge_subgoal(
    subgoal: str, due: Stage | None, pointed_at: Collection[str] | None
) -> SubgoalVerdict:
    """Compare a subgoal with the stage that is due.

    Args:
        subgoal: as the planner said it, perhaps with a point.
        due: None after the last stage.
        pointed_at: names of the objects at the point; None without a point.
    """
    if due is None:
        return "lost"
    words = " ".join(split_point(subgoal)[0].lower().split()).rstrip(".")
    said, _ = split_steps(words)  # how long to wait is no part of the due stage's words
    right = plain_subgoal(due)
    if said == right:
        misses = None not in (pointed_at, due.points_at) and due.points_at not in (pointed_at or ())
        return _other_thing(said, right) if misses else "right"
    if _ORDINAL.sub("", said) == _ORDINAL.sub("", right):
        return "wrong_count"
    return _other_thing(said, right) if said.split()[:1] == right.split()[:1] else "lost"


def _other_thing(said: str, right: str) -> SubgoalVerdict:
    """Return what is wrong with a subgoal of the right act: its thing, or where that goes."""
    ours, theirs = _PLACING.match(right), _PLACING.match(said)
    if ours is None:
        return "wrong_thing"
    return "wrong_place" if theirs and theirs["thing"] == ours["thing"] else "wrong_thing"
