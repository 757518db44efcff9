"""Subgoals as numbers: what a body is asked for, from words with a point."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.episodes import Episode, read_subgoal
from roboirg.extension.sight import ExpertRecording, points_of
from roboirg_learn.policy.moves import LookDecision
from roboirg_learn.policy.sight import Sight

AT = "{at}"
THINGS = ("cube", "tape", "container", "target", "bin", "box", "button")
MOTIONS = (
    *("pick_cube", "place_on", "drop_into", "put_into", "move_over", "put_down", "pick_container"),
    *("press", "press_below", "hover", "hold", "hold_until", "retreat", "go_home"),
)
COLORS = ("red", "green", "blue", "yellow", "gray", "purple")
MARKS = (*MOTIONS, *THINGS, *COLORS, "left", "right")
"""In the order in which trained files have them."""
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


def subgoals_due(
    recorded: ExpertRecording, episode: Episode, looks: Sequence[int]
) -> list[LookDecision]:
    """Return the subgoal that is due at each of some looks."""
    found, stages = [], episode.stages
    for look in looks:
        stage = stages[min(int(recorded.done[look]), len(stages) - 1)]
        at = stage.points_at
        thing = -1 if at is None else recorded.names.index(at)
        found.append(LookDecision(look, SubgoalForm(stage.subgoal), thing))
    return found


def forms_of(episodes: Iterable[Episode]) -> tuple[SubgoalForm, ...]:
    """Return the forms of all subgoals of some episodes, in order."""
    found = {stage.subgoal for one in episodes for stage in one.stages}
    return tuple(map(SubgoalForm, sorted(found)))


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
    kinds = [n for n, name in enumerate(sight.classes) if name.split()[0] == request.thing]
    if request.point is not None and kinds:
        same = [kind for kind in kinds if sight.classes[kind] == f"{request.thing} {request.color}"]
        kind, (row, column) = np.array((same or kinds)[:1]), request.point
        # The point is at the height of what is meant.
        found[-POINT_NUMBERS:] = 1.0, *sight.places(kind, np.array([[column, row]], float))[0]
    return found


def recorded_subgoals(
    recorded: ExpertRecording,
    episode: Episode,
    done: Sequence[int],
    rng: np.random.Generator | None,
) -> list[str]:
    """Return the subgoal after each number of completed stages, with a point from its beginning.

    Args:
        recorded: what was to be seen.
        episode: the episode.
        done: numbers of completed stages.
        rng: moves the points; None leaves them where they are.
    """
    texts: dict[int, str] = {}
    stages = episode.stages
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
