"""Whether a planner's subgoal is what the due stage asks for."""

from __future__ import annotations

import functools
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
    """Return whether a planner's subgoal, in words, is what is due next, or how it is wrong.

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
    said = _Subgoal(_without_point(subgoal))
    right = _Subgoal(plain_subgoal(due))
    is_placing = due.primitive.kind in HANDLES_HELD
    if not said.is_same_act(right):
        # To put the right thing somewhere else is another act, too, but not an unrelated one.
        return "wrong_place" if is_placing and said.is_placing else "lost"

    right_things = _right_things(due, episode, facts)
    if pointed_at is not None and _points_elsewhere(pointed_at, due, right_things):
        return "wrong_place" if is_placing else "wrong_thing"
    if said.words == right.words:
        return "right"
    # With a container, the cube inside is meant. A stage may point at nothing; None would stand for
    # all that is inside of nothing.
    names = {*right_things, due.points_at} - {None}
    meant = [item for item in episode.scene.objects if item.name in names or item.inside in names]
    # "Pick up the cube" without a color or a point does not name one of several cubes.
    if pointed_at is None and said.is_vaguer(right) and _has_others_of_kind(meant, episode.scene):
        return "wrong_thing"
    return _judge_words(said, right, meant)


class _Subgoal:
    """A subgoal, by what its words ask for.

    Attributes:
        words: in lower case, without a point.
        colors: that they name.
    """

    def __init__(self, words: str) -> None:
        self.words = words
        self.colors = set(words.split()) & set(ALL_COLORS)

    @functools.cached_property
    def request(self) -> Request | None:
        """What the words ask for, whatever their ordinal; None if they are no subgoal."""
        return read_subgoal(_ORDINAL.sub("", self.words))

    @property
    def is_placing(self) -> bool:
        """Whether it is to put what is in the hand somewhere."""
        return self.request is not None and self.request.kind in HANDLES_HELD

    @property
    def side(self) -> str | None:
        """The side of the target that the words ask for, if any."""
        return None if self.request is None else self.request.side

    def is_same_act(self, other: _Subgoal) -> bool:
        """Return whether both ask for the same kind of movement, with whatever object."""
        if self.words == other.words:
            return True
        if self.request is None or other.request is None:
            return False
        return self.request.kind == other.request.kind

    def is_vaguer(self, right: _Subgoal) -> bool:
        """Return whether the words for a pick leave out the color that the right ones have."""
        return self.words.startswith("pick") and not self.colors and bool(right.colors)

    def is_other_time(self, right: _Subgoal) -> bool:
        """Return whether the words are about another time than the right ones, of the same thing.

        *For the second time* where *for the first time* is right; *again* fits any time. The
        ordinals of buttons do not count: both have to be pressed, in any order.
        """
        ordinal = _ORDINAL.search(self.words)
        right_ordinal = _ORDINAL.search(right.words)
        if ordinal is None or right_ordinal is None:
            return False
        stands_for_any = ordinal[1] is None
        if stands_for_any or "button" in self.words:
            return False
        return ordinal[1] != right_ordinal[1] and self.colors == right.colors


def _right_things(due: Stage, episode: Episode, facts: AbstractSet[Fact]) -> frozenset[str]:
    """Return the names of the objects with which the due stage can still rightly be completed."""
    index = episode.stages.index(due) if due in episode.stages else 0
    return meant_objects(episode.stages, index, episode.scene, facts)


def _points_elsewhere(
    pointed_at: Collection[str], due: Stage, right_things: AbstractSet[str]
) -> bool:
    """Return whether a point is at none of the objects at which the stage may point.

    To place something, that is one of its places; for any other act, one of the right things.
    """
    if due.points_at is None or due.points_at in pointed_at:
        return False
    if due.primitive.kind not in HANDLES_HELD:
        return right_things.isdisjoint(pointed_at)
    return all(fact.place not in pointed_at for fact in facts_of(due.expects))


def _judge_words(said: _Subgoal, right: _Subgoal, meant: Sequence[SceneObject]) -> SubgoalVerdict:
    """Return how the words of a subgoal compare with the right words for the same act.

    `meant` are the objects with which the stage can rightly be completed. The order matters: a
    wrong color weighs more than a wrong side, and that more than a wrong ordinal.
    """
    if not said.colors <= {item.color for item in meant}:
        return "wrong_place" if "box" in said.words else "wrong_thing"
    if said.side != right.side:
        return "wrong_place"
    return "wrong_count" if said.is_other_time(right) else "right"


def _without_point(subgoal: str) -> str:
    """Return a subgoal in lower case without its point and its time.

    ``Pick up the red cube at <3, 4>.`` becomes ``pick up the red cube``. How long to wait is no
    part of what is compared.
    """
    words, _ = split_point(subgoal)
    words = " ".join(words.lower().split()).rstrip(".")
    words, _ = split_steps(words)
    return words


def _has_others_of_kind(meant: Sequence[SceneObject], scene: Scene) -> bool:
    """Return whether the scene has other objects of the same kinds."""
    kinds = {item.kind for item in meant}
    return any(item.kind in kinds and item not in meant for item in scene.objects)
