"""Choose the arrangements of a study so that colors, sides and numbers are equally frequent.

The choice depends on the tasks and the split only, not on a seed.
"""

from __future__ import annotations

from collections import defaultdict
from typing import NamedTuple, cast

from roboirg.core.episode import Color, Episode, ObjectKind
from roboirg.core.errors import InvalidValueError
from roboirg.tasks import get_task, goals_of
from roboirg.tasks.shared.real_table import left_to_right
from roboirg.tasks.splits.splits import SIZES, check_fixed_split, get_episode

REAL_SUITE = "real"


class Arrangement(NamedTuple):
    """The factors in which the arrangements of a task differ, apart from positions.

    Attributes:
        color: of the target.
        left: color of the object on the robot's left.
        repeats: number of times to handle the target; None where the task has no number.
    """

    color: Color
    left: Color
    repeats: int | None = None

    @property
    def side(self) -> str:
        """Side of the robot on which the target lies."""
        return "left" if self.color == self.left else "right"


def target_kind(task: str) -> ObjectKind:
    """Return the kind of a task's target: box or tape.

    Raises:
        UnknownNameError: there is no such task.
        InvalidValueError: the task is not for a real robot.
    """
    found = get_task(task)
    if found.suite != REAL_SUITE:
        raise InvalidValueError(
            f"{found.name} is not a task for a real robot; those are in the suite {REAL_SUITE!r}."
        )
    return found.things.handled


def read_arrangement(episode: Episode) -> Arrangement:
    """Return the factors of an episode of a real robot's task."""
    goal = episode.goal.as_mapping()
    left, _ = left_to_right(episode.scene, target_kind(episode.task))
    repeats = goal.get("repeats")
    return Arrangement(cast("Color", goal["color"]), left, cast("int | None", repeats))


def counterbalanced_order(task: str) -> tuple[Arrangement, ...]:
    """Return every arrangement of a task once, in the order in which studies use them.

    Pairs of neighbors are opposites in all factors. So, for any number of trials, each factor is as
    even as possible: target colors, left colors, numbers and arrangements differ by at most one,
    and the target's sides by at most two. (Color and left color decide the side: of ten trials,
    only two of the three can be even.) Two colors, no number -> four arrangements: green target,
    green left; purple, purple; green, purple; purple, green.
    """
    episode = get_episode(task, "train", 0)
    first, second = sorted(left_to_right(episode.scene, target_kind(task)))
    numbers = _numbers(episode)
    ordered = []
    # A number has an opposite only where there are two.
    for number, opposite in zip(numbers, reversed(numbers), strict=True):
        ordered.append(Arrangement(first, first, number))
        ordered.append(Arrangement(second, second, opposite))
        ordered.append(Arrangement(first, second, number))
        ordered.append(Arrangement(second, first, opposite))
    return tuple(ordered)


def _numbers(episode: Episode) -> list[int | None]:
    """Return how often goals of a scene may ask to handle the target: ``[1, 2]``, or ``[None]``."""
    numbers = {goal.as_mapping().get("repeats") for goal in goals_of(episode)}
    return cast("list[int | None]", sorted(numbers, key=str))


def counterbalanced_episodes(task: str, split: str, count: int) -> tuple[int, ...]:
    """Return the indices of a split's first episodes whose arrangements are as even as possible.

    The order of arrangements repeats; each repetition uses the next episode of an arrangement.

    Args:
        task: a task for a real robot.
        split: of the episodes.
        count: number of episodes.

    Raises:
        InvalidValueError: the split has too few episodes of an arrangement.
    """
    order = counterbalanced_order(task)
    available = _by_arrangement(task, split)
    chosen: list[int] = []
    for number in range(count):
        repetition, place = divmod(number, len(order))
        episodes = available[order[place]]
        if repetition >= len(episodes):
            raise InvalidValueError(
                f"{count} balanced arrangements of {task} are too many for the split {split!r}; at "
                f"most {len(chosen)}."
            )
        chosen.append(episodes[repetition])
    return tuple(chosen)


def _by_arrangement(task: str, split: str) -> dict[Arrangement, list[int]]:
    """Return the indices of a split's episodes with each arrangement, in order."""
    found: dict[Arrangement, list[int]] = defaultdict(list)
    for index in range(SIZES[check_fixed_split(split)]):
        arrangement = read_arrangement(get_episode(task, split, index))
        found[arrangement].append(index)
    return found
