"""Episodes for the language tests."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from roboirg.core.episode import SPLITS, Episode, Point
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct_with
from roboirg.language.generator import find_refusal
from roboirg.language.instruction import FORMS, Instruction
from roboirg.language.settings import all_settings, plain_settings, settings_of
from roboirg.tasks import every_task, get_task
from roboirg.tasks.splits import splits
from roboirg.tasks.splits.splits import get_episode

TASKS = tuple(every_task())
PAIRS = [
    (name, setting)
    for name, task in every_task().items()
    for setting in settings_of(task)
    if setting in plain_settings()
]
SPATIAL_TASKS = tuple(name for name, task in every_task().items() if "spatial" in settings_of(task))


def split_episodes(task: str) -> Iterator[Episode]:
    """All episodes of all splits."""
    return splits.split_episodes([task], SPLITS)


def first_episodes(task: str, split: str, count: int) -> Iterator[Episode]:
    """The first episodes of a split."""
    for index in range(count):
        yield get_episode(task, split, index)


def random_episodes(task: str, count: int) -> Iterator[Episode]:
    """Episodes of seeds that no split uses, with all patterns and difficulties."""
    for index in range(count):
        yield get_episode(task, "random", 700_000 + index)


def said_where_possible(
    episodes: Iterable[Episode], options: InstructionOptions
) -> Iterator[tuple[Episode, Instruction]]:
    """Yield (episode, instruction) for the episodes that these options can express."""
    for episode in episodes:
        if find_refusal(episode, options) is None:
            yield episode, instruct_with(episode, options)


def without_landmark(episode: Episode) -> Episode:
    """The episode with all cubes at almost the same place, which no words can tell apart."""
    objects = tuple(
        replace(item, position=Point(0.0, index / 1000, 0.02)) if item.kind == "cube" else item
        for index, item in enumerate(episode.scene.objects)
    )
    return replace(episode, scene=replace(episode.scene, objects=objects))


def expressible_options(
    episode: Episode, wordings: str | None = None
) -> Iterator[InstructionOptions]:
    """Yield all options with which an episode can be instructed: every setting, form and variant.

    A setting that cannot express the episode with some options is left out with these.

    Args:
        episode: to instruct.
        wordings: a pool of words, or the identity of an open wording file; None for the usual
            words.
    """
    for name in settings_of(get_task(episode.task)):
        usual = InstructionOptions(name, wordings=wordings)
        variants = [replace(usual, **changes) for changes in all_settings()[name].variants]
        possible = [options for options in variants if find_refusal(episode, options) is None]
        for form in FORMS:
            yield from (replace(options, form=form) for options in possible)
