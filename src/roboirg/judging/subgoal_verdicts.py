"""Whether a planner's subgoal is what the due stage asks for."""

from __future__ import annotations

import re
from collections.abc import Collection
from collections.abc import Set as AbstractSet
from typing import Literal, get_args

from roboirg.core.conditions import Fact, facts_of
from roboirg.core.episode import ALL_COLORS, HANDLES_HELD, Episode, Scene, Stage
from roboirg.core.subgoal_text import split_point, split_steps
from roboirg.core.subgoal_words import read_subgoal
from roboirg.judging.judge import plain_subgoal
from roboirg.judging.meant_objects import meant_objects

SubgoalVerdict = Literal["right", "wrong_thing", "wrong_place", "wrong_count", "lost"]
"""The subgoal is what is due; names or points at another thing; another place for the right thing;
the right act for another time; or an act that is not due."""
SUBGOAL_VERDICTS: tuple[SubgoalVerdict, ...] = get_args(SubgoalVerdict)

_ORDINAL = re.compile(
    r"\s*(?:for the )?\b(?:(first|second|third|fourth|fifth|sixth|\d+(?:st|nd|rd|th))\b(?: time)?"
    r"|again\b|once more\b)"
)


def judge_subgoal(
    subgoal: str,
    due: Stage | None,
    pointed_at: Collection[str] | None,
    episode: Episode,
    facts: AbstractSet[Fact] = frozenset(),
) -> SubgoalVerdict:
    """Compare a subgoal with the stage that is due.

    Ordinals may be left out, objects that look alike may stand for each other, and so may stages
    that can be done in any order. A point outweighs the words.

    Args:
        subgoal: as the planner said it, perhaps with a point.
        due: None after the last stage.
        pointed_at: names of the objects at the point; None without a point.
        episode: what is played.
        facts: that hold, by which what is done for good is not due again.
    """
    if due is None:
        return "lost"
    words = " ".join(split_point(subgoal)[0].lower().split()).rstrip(".")
    said, right = split_steps(words)[0], plain_subgoal(due)  # how long to wait is no part of it
    theirs, ours = (read_subgoal(_ORDINAL.sub("", one)) for one in (said, right))
    is_placing = due.primitive.kind in HANDLES_HELD
    if said != right and (theirs is None or ours is None or theirs.kind != ours.kind):
        moves = theirs is not None and theirs.kind in HANDLES_HELD and is_placing
        return "wrong_place" if moves else "lost"
    index = episode.stages.index(due) if due in episode.stages else 0
    things = meant_objects(episode.stages, index, episode.scene, facts)
    meant = {*things, due.points_at}
    if is_placing:
        meant = {due.points_at, *(one.place for one in facts_of(due.expects))}
    if None not in (pointed_at, due.points_at) and not meant & set(pointed_at or ()):
        return "wrong_place" if is_placing else "wrong_thing"
    if said == right:
        return "right"
    wrong = _wrong_words(said, right, episode.scene, things | {due.points_at}, pointed_at is None)
    is_elsewhere = theirs is not None and ours is not None and theirs.side != ours.side
    return wrong or ("wrong_place" if is_elsewhere else _wrong_time(said, right))


def _wrong_words(
    said: str, right: str, scene: Scene, meant: Collection[str | None], alone: bool
) -> SubgoalVerdict | None:
    """Return what the words name that is not meant; `alone` if no point helps them."""
    items = [item for item in scene.objects if {item.name, item.inside} & set(meant)]
    named, asked = (set(words.split()) & set(ALL_COLORS) for words in (said, right))
    if named - {item.color for item in items}:
        return "wrong_place" if "box" in said else "wrong_thing"
    alike = {item.name for kind in {one.kind for one in items} for item in scene.of_kind(kind)}
    is_vague = alone and asked and not named and said.startswith("pick") and alike - set(meant)
    return "wrong_thing" if is_vague else None


def _wrong_time(said: str, right: str) -> SubgoalVerdict:
    """Return ``wrong_count`` if both words have an ordinal of the same thing, and another one."""
    theirs, ours = (_ORDINAL.search(words) for words in (said, right))
    is_other = bool(theirs and ours and theirs[1] and theirs[1] != ours[1])
    is_same_thing = set(said.split()) & set(ALL_COLORS) == set(right.split()) & set(ALL_COLORS)
    return "wrong_count" if is_other and is_same_thing and "button" not in said else "right"
