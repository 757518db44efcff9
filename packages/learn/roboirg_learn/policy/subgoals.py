"""Subgoals as numbers: what hands are to do, from words with a point.

A subgoal is what is to be done next, as in "pick up the red cube at <110, 84>", with row and column
of the place in the front picture. An episode has stages, and each has a subgoal.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.episodes import Episode, read_subgoal
from roboirg.extension.sight import ExpertRecording, points_of
from roboirg_learn.policy.moves import LookDecision
from roboirg_learn.policy.sight import COLUMNS, Sight

POINT_SLOT = "{at}"
"""In the words of a subgoal, where its point is to stand."""
NO_THING = -1
"""In the place of an object's number where a subgoal points at none."""
LAST_PIXEL = COLUMNS - 1
"""Greatest column and row of the front picture."""
THINGS = ("cube", "tape", "container", "target", "bin", "box", "button")
MOTIONS = (
    "pick_cube", "place_on", "drop_into", "put_into", "move_over", "put_down", "pick_container",
    "press", "press_below", "hover", "hold", "hold_until", "retreat", "go_home",
)  # fmt: skip
COLORS = ("red", "green", "blue", "yellow", "gray", "purple")
REQUEST_WORDS = (*MOTIONS, *THINGS, *COLORS, "left", "right")
"""Words that a request may have, each a number that is 0 or 1, in the order of trained files."""
POINT_NUMBERS = 3
"""Whether there is a point, and its x and y on the table, m."""
REQUEST_SIZE = len(REQUEST_WORDS) + POINT_NUMBERS
"""How many numbers a request to hands has."""
POINT_NOISE = 3.2
"""Standard deviation of the noise of a point, pixels."""
MOST_POINT_NOISE = 8.0
"""Limit of that noise, pixels."""


class SubgoalForm(NamedTuple):
    """A subgoal in words, with ``{at}`` where its point stands if it has one."""

    words: str

    @property
    def at_thing(self) -> bool:
        """Whether it has a point."""
        return POINT_SLOT in self.words

    def at(self, point: NDArray[np.floating] | None) -> str:
        """Return the subgoal's words with a point: "pick up the cube at <110, 84>".

        Args:
            point: column and row in the front picture, pixels, though the words have the row
                first; None for words without a point.
        """
        if point is None:
            return self.words.replace(f" {POINT_SLOT}", "")
        column, row = np.clip(np.rint(point), 0, LAST_PIXEL).astype(int)
        return self.words.replace(POINT_SLOT, f"at <{row}, {column}>")


def subgoals_due(
    recorded: ExpertRecording, episode: Episode, looks: Sequence[int]
) -> list[LookDecision]:
    """Return the subgoal that is due at each of some looks, with the object that it points at.

    An episode has stages, each with a subgoal; due is the stage after those that are completed.

    Args:
        recorded: knows at each look how many stages are completed.
        episode: the episode.
        looks: numbers of looks.
    """
    found = []
    for look in looks:
        stage = episode.stages[_stage_after(int(recorded.done[look]), episode)]
        thing = NO_THING
        if stage.points_at is not None:
            thing = recorded.names.index(stage.points_at)
        found.append(LookDecision(look, SubgoalForm(stage.subgoal), thing))
    return found


def _stage_after(done: int, episode: Episode) -> int:
    """Return the number of the stage that is under way after completed ones, at most the last."""
    return min(done, len(episode.stages) - 1)


def forms_of(episodes: Iterable[Episode]) -> tuple[SubgoalForm, ...]:
    """Return the forms of all subgoals of some episodes, in order."""
    found: set[str] = set()
    for episode in episodes:
        found.update(stage.subgoal for stage in episode.stages)
    return tuple(SubgoalForm(words) for words in sorted(found))


def encode_request(subgoal: str, sight: Sight) -> NDArray[np.float32] | None:
    """Return a subgoal in words as numbers for hands (REQUEST_SIZE,); None for unknown words.

    1 for each of `REQUEST_WORDS` that it has (verb, thing, color, side), else 0; then whether it
    has a point, and the point's x and y on the table, m.
    """
    request = read_subgoal(subgoal)
    if request is None:
        return None
    found = np.zeros(REQUEST_SIZE, np.float32)
    for name in (request.kind, request.thing, request.color, request.side):
        if name is not None:
            found[REQUEST_WORDS.index(name)] = 1.0
    class_number = _class_number(request.thing, request.color, sight)
    if request.point is not None and class_number is not None:
        row, column = request.point
        # A pixel is a place on the table only at a known height: that of what is meant.
        places = sight.places(np.array([class_number]), np.array([[column, row]], float))
        found[-POINT_NUMBERS:] = 1.0, *places[0]
    return found


def _class_number(thing: str | None, color: str | None, sight: Sight) -> int | None:
    """Return the number of the class of a thing with a color: "cube" and "red" → "cube red".

    If there is none, as for a thing without color, the first class of the thing; else None.
    """
    same_thing = None
    for number, name in enumerate(sight.classes):
        if name == f"{thing} {color}":
            return number
        if same_thing is None and name.split()[0] == thing:
            same_thing = number
    return same_thing


def recorded_subgoals(
    recorded: ExpertRecording,
    episode: Episode,
    done: Sequence[int],
    rng: np.random.Generator | None,
) -> list[str]:
    """Return the subgoals, in words with points, that a planner would have named in an episode.

    A subgoal points where its object was when its stage began, in all looks of the stage.

    Args:
        recorded: places of objects at each look.
        episode: the episode.
        done: for each subgoal that is wanted, how many stages are completed then.
        rng: moves the points a little, as a planner would err; None leaves them where they are.
    """
    texts: dict[int, str] = {}
    numbers = [_stage_after(count, episode) for count in done]
    for number in set(numbers):
        stage = episode.stages[number]
        point = None
        if stage.points_at is not None:
            point = _point_at_begin(recorded, number, stage.points_at)
            if rng is not None:
                point += _noise(rng)
        texts[number] = SubgoalForm(stage.subgoal).at(point)
    return [texts[number] for number in numbers]


def _point_at_begin(recorded: ExpertRecording, stage: int, name: str) -> NDArray[np.float64]:
    """Return column and row, pixels, of an object by name at the first look of a stage, from 0."""
    has_begun = ~recorded.is_video & (recorded.done >= stage)
    first_look = int(np.flatnonzero(has_begun)[0])
    position = recorded.things[first_look, recorded.names.index(name), :3]
    return points_of(position.astype(np.float64))


def _noise(rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw by how many pixels a point is moved, column and row; each at most `MOST_POINT_NOISE`."""
    from scipy.stats import truncnorm  # takes a second, and looks for PyTorch

    # The distribution takes its limits in standard deviations.
    most = MOST_POINT_NOISE / POINT_NOISE
    drawn: NDArray[np.float64] = truncnorm.rvs(
        -most, most, scale=POINT_NOISE, size=2, random_state=rng
    )
    return drawn
