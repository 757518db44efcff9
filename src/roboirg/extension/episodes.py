"""Episodes, the goals of their scenes, and the words that mean them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from roboirg.core.episode import ENVIRONMENT_VERSION, Episode, Goal, Split
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.subgoal_words import read_subgoal
from roboirg.language import FORMS
from roboirg.language.scenarios.identity import language_label
from roboirg.language.settings import all_settings, plain_settings
from roboirg.language.variants import instructions
from roboirg.policies.planners.model_planners import merge_keyframes
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.tasks import goals_of, with_goal
from roboirg.tasks.splits.splits import SIZES, get_episode

__all__ = [
    "ENVIRONMENT_VERSION",
    "Episode",
    "Goal",
    "all_settings",
    "episodes_of",
    "goal_schema",
    "goals_of",
    "language_label",
    "merge_keyframes",
    "plain_settings",
    "read_subgoal",
    "spoken",
    "with_goal",
]


def episodes_of(
    tasks: Sequence[str], split: Split, count: int | None = None
) -> tuple[Episode, ...]:
    """Return the first episodes of each task in a split: all of the first task, then of the second.

    Args:
        tasks: names of tasks.
        split: train, val, test or random.
        count: of each task; None for the whole split, which random has no end for.

    Raises:
        UnknownNameError: there is no task of a name.
        InvalidValueError: the split is shorter.
    """
    size = SIZES[split] if count is None else count
    episodes = []
    for task in tasks:
        for number in range(size):
            episodes.append(get_episode(task, split, number))
    return tuple(episodes)


def spoken(
    episodes: Sequence[Episode],
    settings: Sequence[str],
    pool: str,
) -> Iterator[tuple[Episode, str]]:
    """Yield the implicit instructions of episodes, as texts, each with its episode.

    Args:
        episodes: the episodes.
        settings: names; one that a task lacks, or that cannot express an episode, is left out.
        pool: of wordings: train or test.
    """
    options = InstructionOptions(wordings=pool)
    for episode, instruction in instructions(episodes, settings, FORMS[:1], options):
        yield episode, instruction.text
