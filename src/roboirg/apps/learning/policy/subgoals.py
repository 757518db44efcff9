"""Subgoals as numbers: what a body is asked for, from words with a point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.learning.policy.recording import ExpertRecording
from roboirg.apps.learning.policy.sight import Sight, points_of
from roboirg.core.episode import ALL_COLORS, PrimitiveKind, Stage
from roboirg.policies.hands.subgoal_words import Request, read_subgoal

AT = "{at}"
THINGS = ("cube", "tape", "container", "target", "bin", "box", "button")
MARKS = (*get_args(PrimitiveKind), *THINGS, *ALL_COLORS, "left", "right")
POINT_NUMBERS = 3
"""Whether there is a point, and its x and y on the table, m."""
ASKED_NUMBERS = len(MARKS) + POINT_NUMBERS
SPREAD, FARTHEST = 3.2, 8.0
"""Standard deviation and limit of the noise of a point, pixels."""


class SubgoalForm(NamedTuple):
    """A subgoal in words, with ``{at}`` where its point stands if it has one."""

    words: str

    @property
    def at_thing(self) -> bool:
        """Whether it has a point."""
        return AT in self.words

    def at(self, point: NDArray[np.floating] | None) -> str:
        """Return it with a point, column and row in the front picture; None leaves that out."""
        if point is None:
            return self.words.replace(f" {AT}", "")
        column, row = np.clip(np.rint(point), 0, 255).astype(int)
        return self.words.replace(AT, f"at <{row}, {column}>")


class SubgoalDecision(NamedTuple):
    """A subgoal to learn, as `ExpertDecision` is a waypoint to learn.

    Attributes:
        look: number of the look at which it is due.
        move: its form.
        thing: number of the object at which it points; -1 for none.
    """

    look: int
    move: SubgoalForm
    thing: int


def subgoals_due(
    recorded: ExpertRecording, stages: Sequence[Stage], looks: Sequence[int]
) -> list[SubgoalDecision]:
    """Return the subgoal that is due at each of some looks."""
    found = []
    for look in looks:
        stage = stages[min(int(recorded.done[look]), len(stages) - 1)]
        at = stage.points_at
        thing = -1 if at is None else recorded.names.index(at)
        found.append(SubgoalDecision(look, SubgoalForm(stage.subgoal), thing))
    return found


def forms_of(stages: Sequence[Sequence[Stage]]) -> tuple[SubgoalForm, ...]:
    """Return the forms of all subgoals of some episodes, in order."""
    return tuple(map(SubgoalForm, sorted({one.subgoal for own in stages for one in own})))


def asked_numbers(subgoal: str, sight: Sight) -> NDArray[np.float32] | None:
    """Return verb, kind, color and side as marks, and the point (`ASKED_NUMBERS`).

    None if the words are no subgoal that is known.
    """
    request = read_subgoal(subgoal)
    if request is None:
        return None
    found = np.zeros(ASKED_NUMBERS, np.float32)
    for name in (request.kind, request.thing, request.color, request.side):
        if name is not None:
            found[MARKS.index(name)] = 1.0
    place = _place(request, sight)
    if place is not None:
        found[-POINT_NUMBERS:] = 1.0, *place
    return found


def _place(request: Request, sight: Sight) -> NDArray[np.float32] | None:
    """Return x and y, m, of the point of a subgoal, at the height of what is meant."""
    kinds = [n for n, name in enumerate(sight.classes) if name.split()[0] == request.thing]
    if request.point is None or not kinds:
        return None
    same = [kind for kind in kinds if sight.classes[kind] == f"{request.thing} {request.color}"]
    row, column = request.point
    kind = np.array((same or kinds)[:1])
    place: NDArray[np.float32] = sight.places(kind, np.array([[column, row]], float))[0]
    return place


def recorded_subgoals(
    recorded: ExpertRecording,
    stages: Sequence[Stage],
    done: Sequence[int],
    rng: np.random.Generator | None,
) -> list[str]:
    """Return the subgoal after each number of completed stages, with a point from its beginning.

    Args:
        recorded: the episode.
        stages: of its goal.
        done: numbers of completed stages.
        rng: moves the points; None leaves them where they are.
    """
    texts: dict[int, str] = {}
    for index in {min(number, len(stages) - 1) for number in done}:
        stage, point = stages[index], None
        if stage.points_at is not None:
            began = int(np.flatnonzero(~recorded.is_video & (recorded.done >= index))[0])
            spot = recorded.things[began, recorded.names.index(stage.points_at), :3]
            point = points_of(spot.astype(np.float64))
            if rng is not None:
                from scipy.stats import truncnorm  # takes a second, and looks for PyTorch

                most = FARTHEST / SPREAD
                point += truncnorm.rvs(-most, most, scale=SPREAD, size=2, random_state=rng)
        texts[index] = SubgoalForm(stage.subgoal).at(point)
    return [texts[min(number, len(stages) - 1)] for number in done]
