"""Subgoals as numbers: what hands are to do, from words with a point.

A subgoal is what is to be done next, as in "pick up the red cube at <110, 84>", with row and column
in the front picture. An episode has stages, and each has a subgoal. A planner names subgoals, hands
follow them; a template is a subgoal without its point, such as "pick up the red cube {at}".
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.episodes import Episode, read_subgoal
from roboirg.extension.sight import ExpertRecording, points_of
from roboirg_learn.policy.moves import LookDecision
from roboirg_learn.policy.sight import COLUMNS, ObjectClasses

POINT_SLOT = "{at}"
"""In the words of a subgoal, where its point is to stand."""
NO_OBJECT = -1
"""In the place of an object's number where a subgoal points at none."""
LAST_PIXEL = COLUMNS - 1
"""Greatest column and row of the front picture."""
# The order of these words is that of the inputs of trained networks: append, never sort.
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


class SubgoalTemplate(NamedTuple):
    """A subgoal in words, with ``{at}`` where its point stands if it has one.

    Planners choose among these as bodies choose among `Move`, which also has `at_object`.
    """

    words: str

    @property
    def at_object(self) -> bool:
        """Whether it has a point, that of an object."""
        return POINT_SLOT in self.words

    def at(self, point: NDArray[np.floating] | None) -> str:
        """Return the subgoal's words with a point.

        "pick up the cube {at}" with (84, 110) → "pick up the cube at <110, 84>".

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
    `recorded_subgoals` returns them in words, with points.

    Args:
        recorded: knows at each look how many stages are completed.
        episode: the episode.
        looks: numbers of looks.
    """
    found = []
    for look in looks:
        stage = episode.stages[_stage_after(int(recorded.done[look]), episode)]
        object_number = NO_OBJECT
        if stage.points_at is not None:
            object_number = recorded.names.index(stage.points_at)
        found.append(LookDecision(look, SubgoalTemplate(stage.subgoal), object_number))
    return found


def _stage_after(stages_done: int, episode: Episode) -> int:
    """Return the number of the stage that is due, given how many are completed.

    When all are, it is the last one.
    """
    return min(stages_done, len(episode.stages) - 1)


def templates_of(episodes: Iterable[Episode]) -> tuple[SubgoalTemplate, ...]:
    """Return the templates of all subgoals of some episodes, each once, sorted.

    A template's place is its number in trained networks.
    """
    found: set[str] = set()
    for episode in episodes:
        found.update(stage.subgoal for stage in episode.stages)
    return tuple(SubgoalTemplate(words) for words in sorted(found))


def encode_request(subgoal: str, object_classes: ObjectClasses) -> NDArray[np.float32] | None:
    """Return a subgoal in words as numbers for hands (REQUEST_SIZE,); None for unknown words.

    1 for each of `REQUEST_WORDS` that it has (motion, object, color, side), else 0; then whether it
    has a point, and the point's x and y on the table, m. "pick up the red cube at <110, 84>" has 1
    for *pick_cube*, *cube*, *red* and the point.
    """
    request = read_subgoal(subgoal)
    if request is None:
        return None
    encoded = np.zeros(REQUEST_SIZE, np.float32)
    for word in (request.kind, request.thing, request.color, request.side):
        if word is not None:
            encoded[REQUEST_WORDS.index(word)] = 1.0
    class_number = _class_number(request.thing, request.color, object_classes)
    if request.point is not None and class_number is not None:
        row, column = request.point
        point = np.array([[column, row]], float)
        # A pixel is a position on the table only at a known height: that of what is meant.
        ((x, y),) = object_classes.table_positions(np.array([class_number]), point)
        encoded[-POINT_NUMBERS:] = 1.0, x, y
    return encoded


def _class_number(
    thing: str | None, color: str | None, object_classes: ObjectClasses
) -> int | None:
    """Return the number of the class of a thing with a color: "cube" and "red" → of "cube red".

    If there is none, as for a thing without color, the first class of the thing; if there is none
    of the thing either, None.
    """
    first_of_thing = None
    for number, name in enumerate(object_classes.names):
        if name == f"{thing} {color}":
            return number
        if first_of_thing is None and name.split()[0] == thing:
            first_of_thing = number
    return first_of_thing


def recorded_subgoals(
    recorded: ExpertRecording,
    episode: Episode,
    stages_done: Sequence[int],
    rng: np.random.Generator | None,
) -> list[str]:
    """Return the subgoals, in words with points, that a planner would have named in an episode.

    A subgoal points where its object was when its stage began, in all looks of the stage.

    Args:
        recorded: positions of objects at each look.
        episode: the episode.
        stages_done: for each subgoal that is wanted, how many stages are completed then.
        rng: moves the points a little, as a planner would err; None leaves them where they are.
    """
    texts: dict[int, str] = {}
    numbers = [_stage_after(count, episode) for count in stages_done]
    # One draw for each stage; the order of a set of integers is the same in every process.
    for number in set(numbers):
        stage = episode.stages[number]
        point = None
        if stage.points_at is not None:
            point = _point_at_begin(recorded, number, stage.points_at)
            if rng is not None:
                point += _draw_point_noise(rng)
        texts[number] = SubgoalTemplate(stage.subgoal).at(point)
    return [texts[number] for number in numbers]


def _point_at_begin(recorded: ExpertRecording, stage: int, name: str) -> NDArray[np.float64]:
    """Return column and row, pixels, of an object by name at the first look of a stage (2,).

    The video counts as no stage; stages are numbered from 0.
    """
    has_begun = ~recorded.is_video & (recorded.done >= stage)
    first_look = int(np.flatnonzero(has_begun)[0])
    position = recorded.things[first_look, recorded.names.index(name), :3]
    return points_of(position.astype(np.float64))


def _draw_point_noise(rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw by how many pixels a point is moved, column and row; each at most `MOST_POINT_NOISE`.

    It is a normal distribution, truncated.
    """
    from scipy.stats import truncnorm  # takes a second, and looks for PyTorch

    # The distribution takes its limits in standard deviations.
    most = MOST_POINT_NOISE / POINT_NOISE
    drawn: NDArray[np.float64] = truncnorm.rvs(
        -most, most, scale=POINT_NOISE, size=2, random_state=rng
    )
    return drawn
