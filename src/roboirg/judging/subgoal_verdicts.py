"""Whether a planner's subgoal is what the due stage asks for."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from collections.abc import Set as AbstractSet
from typing import Literal, get_args

from roboirg.core.conditions import Fact, facts_of
from roboirg.core.episode import ALL_COLORS, HANDLES_HELD, Episode, Scene, SceneObject, Stage
from roboirg.core.subgoal_text import split_point, split_steps
from roboirg.core.subgoal_words import Request, read_subgoal
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
"""An ordinal as its group 1: *for the second time*; or a word that stands for one: *again*."""


def judge_subgoal(
    subgoal: str,
    due: Stage | None,
    pointed_at: Collection[str] | None,
    episode: Episode,
    facts: AbstractSet[Fact] = frozenset(),
) -> SubgoalVerdict:
    """Compare a subgoal with the stage that is due.

    Where *pick up the red cube* is due: itself -> ``right``, *pick up the green cube* ->
    ``wrong_thing``, *press the button* -> ``lost``. Ordinals may be left out, objects that look
    alike may stand for each other, and so may stages that can be done in any order. A point that is
    wrong decides, whatever the words.

    Args:
        subgoal: as the planner said it, perhaps with a point.
        due: None after the last stage.
        pointed_at: names of the objects at the point; None without a point.
        episode: what is played.
        facts: that hold, by which what is done for good is not due again.
    """
    if due is None:
        return "lost"
    said = _without_point(subgoal)
    right = plain_subgoal(due)
    is_placing = due.primitive.kind in HANDLES_HELD
    if not _is_same_act(said, right):
        # To put the right thing somewhere else is another act, too, but not an unrelated one.
        return "wrong_place" if is_placing and _is_placing(said) else "lost"

    index = episode.stages.index(due) if due in episode.stages else 0
    right_things = meant_objects(episode.stages, index, episode.scene, facts)
    right_targets = _places(due) if is_placing else right_things
    if pointed_at is not None and _is_elsewhere(pointed_at, due, right_targets):
        return "wrong_place" if is_placing else "wrong_thing"

    if said == right:
        return "right"
    # A stage may point at nothing; None would stand for all that is inside of nothing.
    meant = _objects(episode.scene, {*right_things, due.points_at} - {None})
    # "Pick up the cube" without a color or a point does not name one of several cubes.
    if pointed_at is None and _is_vague(said, right) and _have_alike(meant, episode.scene):
        return "wrong_thing"
    return _judge_words(said, right, meant)


def _is_elsewhere(
    pointed_at: Collection[str], due: Stage, right_targets: AbstractSet[str | None]
) -> bool:
    """Return whether a point is at none of the objects at which the stage may point."""
    if due.points_at is None or due.points_at in pointed_at:
        return False
    return right_targets.isdisjoint(pointed_at)


def _judge_words(said: str, right: str, meant: Sequence[SceneObject]) -> SubgoalVerdict:
    """Compare the words of a subgoal with the right ones for the same act.

    `meant` are the objects with which the stage can rightly be completed. The order matters: a
    wrong color weighs more than a wrong side, and that more than a wrong ordinal.
    """
    if not _colors(said) <= {item.color for item in meant}:
        return "wrong_place" if "box" in said else "wrong_thing"
    if _side(said) != _side(right):
        return "wrong_place"
    return "wrong_count" if _is_other_time(said, right) else "right"


def _without_point(subgoal: str) -> str:
    """Return a subgoal in lower case without its point and its time.

    ``Pick up the red cube at <3, 4>.`` becomes ``pick up the red cube``. How long to wait is no
    part of what is compared.
    """
    words, _ = split_point(subgoal)
    words = " ".join(words.lower().split()).rstrip(".")
    words, _ = split_steps(words)
    return words


def _request(words: str) -> Request | None:
    """Return what words ask for, whatever their ordinal; None if they are no subgoal."""
    return read_subgoal(_ORDINAL.sub("", words))


def _is_same_act(said: str, right: str) -> bool:
    """Return whether two subgoals ask for the same kind of movement, with whatever object."""
    if said == right:
        return True
    said_request = _request(said)
    right_request = _request(right)
    if said_request is None or right_request is None:
        return False
    return said_request.kind == right_request.kind


def _is_placing(said: str) -> bool:
    """Return whether words ask to put what is in the hand somewhere."""
    request = _request(said)
    return request is not None and request.kind in HANDLES_HELD


def _side(words: str) -> str | None:
    """Return the side of the target that words ask for, if any."""
    request = _request(words)
    return None if request is None else request.side


def _places(stage: Stage) -> frozenset[str | None]:
    """Return the places in what a stage expects."""
    return frozenset(fact.place for fact in facts_of(stage.expects))


def _objects(scene: Scene, names: Collection[str | None]) -> list[SceneObject]:
    """Return the objects of some names, and the cubes that are inside such an object."""
    return [item for item in scene.objects if item.name in names or item.inside in names]


def _is_vague(said: str, right: str) -> bool:
    """Return whether words for a pick leave out the color that the right ones have."""
    return said.startswith("pick") and not _colors(said) and bool(_colors(right))


def _have_alike(meant: Sequence[SceneObject], scene: Scene) -> bool:
    """Return whether the scene has other objects of the same kinds."""
    kinds = {item.kind for item in meant}
    return any(item.kind in kinds and item not in meant for item in scene.objects)


def _is_other_time(said: str, right: str) -> bool:
    """Return whether words have another ordinal than the right ones, of the same thing.

    *For the second time* where *for the first time* is right; *again* fits any time. The ordinals
    of buttons do not count: both have to be pressed, in any order.
    """
    said_ordinal = _ORDINAL.search(said)
    right_ordinal = _ORDINAL.search(right)
    if said_ordinal is None or right_ordinal is None:
        return False
    stands_for_any = said_ordinal[1] is None
    if stands_for_any or "button" in said:
        return False
    return said_ordinal[1] != right_ordinal[1] and _colors(said) == _colors(right)


def _colors(words: str) -> set[str]:
    """Return the colors that words name."""
    return set(words.split()) & set(ALL_COLORS)
