"""Which arrangements a study has, so that no color, side or number is more frequent than others.

What is chosen depends on the tasks and the split alone, never on a seed.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

from roboirg.core.episode import Color, Episode, ObjectKind
from roboirg.core.errors import InvalidValueError
from roboirg.episodes.splits import SIZES, check_split, get_episode
from roboirg.tasks import get_task
from roboirg.tasks.shared.real_table import left_to_right

REAL_SUITE = "real"
KINDS: dict[str, ObjectKind] = {"box": "box", "tape": "tape"}


class Arrangement(NamedTuple):
    """What differs between the arrangements of a task, places aside.

    Attributes:
        color: of the target.
        left: color of the thing on the robot's left.
        repeats: how often the target is to be handled; None where the task has no number.
    """

    color: Color
    left: Color
    repeats: int | None = None

    @property
    def side(self) -> str:
        """On which side of the robot the target is."""
        return "left" if self.color == self.left else "right"


def kind_of(task: str) -> ObjectKind:
    """What the task's target is: a box or a tape.

    Raises:
        UnknownNameError: there is no such task.
        InvalidValueError: it is none of the real robot's.
    """
    found = get_task(task)
    if found.suite != REAL_SUITE:
        raise InvalidValueError(
            f"{found.name} is no task of the real robot; those are of the suite {REAL_SUITE!r}."
        )
    return KINDS[found.commands.thing]


def arrangement_of(episode: Episode) -> Arrangement:
    """What an episode of a real robot's task has where others differ."""
    goal = episode.goal.as_mapping()
    left, _ = left_to_right(episode.scene, kind_of(episode.task))
    repeats = goal.get("repeats")
    target = next(one.color for one in episode.scene.objects if one.color == goal["color"])
    if target is None:  # the task's goals are colors of its things
        raise InvalidValueError(f"{episode.key} has no thing of the color {goal['color']!r}.")
    return Arrangement(target, left, repeats if isinstance(repeats, int) else None)


def balanced_order(task: str) -> tuple[Arrangement, ...]:
    """Every arrangement of a task once, in the order in which a study of any size takes them.

    Each and the next but one that follows it are opposites in all respects. So, whatever the
    number of trials, each respect is as even as can be: target colors, left colors and numbers
    differ by at most one, arrangements too, and the target's sides by at most two. (Color and
    left color decide the side: of ten trials only two of the three can be even.)
    """
    episode = get_episode(task, "train", 0)
    colors = left_to_right(episode.scene, kind_of(task))
    first, second = sorted(colors)
    goals = get_task(task).goals(episode.scene)
    numbers = sorted({goal.as_mapping().get("repeats") for goal in goals}, key=str)
    ordered: list[Arrangement] = []
    # A number opposes another only where there are two.
    for number, left in product(range(len(numbers)), (first, second)):
        opposite = numbers[len(numbers) - 1 - number]
        ordered.append(_arrangement(first, left, numbers[number]))
        ordered.append(_arrangement(second, second if left == first else first, opposite))
    return tuple(ordered)


def balanced_episodes(task: str, split: str, count: int) -> tuple[int, ...]:
    """So many episodes of a split, with arrangements as even as can be, the first that fit.

    Raises:
        InvalidValueError: the split has too few of an arrangement.
    """
    wanted = balanced_order(task)
    found = _by_arrangement(task, split)
    chosen: list[int] = []
    for number in range(count):
        arrangement, turn = wanted[number % len(wanted)], number // len(wanted)
        if turn >= len(found[arrangement]):
            raise InvalidValueError(
                f"{count} balanced arrangements of {task} are too many for the split {split!r}; at "
                f"most {len(chosen)}."
            )
        chosen.append(found[arrangement][turn])
    return tuple(chosen)


def arrangement_counts(episodes: Sequence[Episode]) -> dict[str, Counter[object]]:
    """How often each color, side and number occurs, and each arrangement."""
    kinds = [arrangement_of(episode) for episode in episodes]
    return {
        "arrangement": Counter(kinds),
        "color": Counter(one.color for one in kinds),
        "left": Counter(one.left for one in kinds),
        "repeats": Counter(one.repeats for one in kinds),
        "side": Counter(one.side for one in kinds),
    }


def _arrangement(color: Color, left: Color, repeats: object) -> Arrangement:
    return Arrangement(color, left, repeats if isinstance(repeats, int) else None)


def _by_arrangement(task: str, split: str) -> dict[Arrangement, list[int]]:
    found: dict[Arrangement, list[int]] = defaultdict(list)
    for index in range(SIZES[check_split(split)]):
        found[arrangement_of(get_episode(task, split, index))].append(index)
    return found
