"""What the language tests share: episodes, and every way to say one."""

import contextlib
import functools
import itertools
from collections.abc import Iterator
from typing import Any

from roboirg.episode import SPLITS, Episode, Split
from roboirg.errors import SceneRejectedError
from roboirg.language import FORMS, STAGE_SETS, expressible
from roboirg.splits import CYCLE, SIZES, get_episode, make_episode, slot_seed
from roboirg.tasks import all_tasks, get_task

TASKS = tuple(all_tasks())
PAIRS = [(name, setting) for name, task in all_tasks().items() for setting in task.settings]

SEEDS_TRIED = 30
"""For an episode of a split whose seeds have not been tried."""

Variant = tuple[str, str, dict[str, Any]]


def split_episodes(task: str) -> Iterator[Episode]:
    for split in SPLITS:
        yield from first_episodes(task, split, SIZES[split])


def first_episodes(task: str, split: Split, count: int) -> Iterator[Episode]:
    """The first episodes of a split."""
    for index in range(count):
        yield tellable_episode(task, split, index)


@functools.cache
def tellable_episode(task: str, split: Split, index: int) -> Episode:
    """The split's episode; while its seeds have not been tried, that of the first seed that fits.

    A seed fits if it yields a scene and every setting can tell it.
    """
    first = slot_seed(get_task(task), split, index)
    makers = [functools.partial(get_episode, task, split, index)]
    makers += [
        functools.partial(make_episode, task, seed, CYCLE[index % len(CYCLE)], split, index)
        for seed in range(first, first + SEEDS_TRIED)
    ]
    for make in makers:
        with contextlib.suppress(SceneRejectedError):
            episode = make()
            if expressible(episode) == get_task(task).settings:
                return episode
    raise AssertionError(f"no tellable episode for {task}/{split}/{index}")


def random_episodes(task: str, count: int, base: int = 7_000_000) -> Iterator[Episode]:
    """Episodes of seeds that no split uses, with all patterns and difficulties."""
    index = 0
    for seed in itertools.count(base):
        if index == count:
            return
        try:
            yield make_episode(task, seed, CYCLE[index % len(CYCLE)], "test", index)
        except SceneRejectedError:
            continue
        index += 1


def options_of(setting: str, episode: Episode) -> Iterator[dict[str, Any]]:
    if setting == "contextual":
        for stages, distractor in itertools.product(STAGE_SETS, ("neutral", "competing")):
            yield {"stages": stages, "distractor": distractor}
    elif setting == "spatial":
        for frame in ("robot", "camera"):
            if setting in expressible(episode, frame=frame):
                yield {"frame": frame}
    else:
        yield {}


def variants(episode: Episode) -> Iterator[Variant]:
    """Every setting, form, stage set, distractor level and frame of an episode."""
    for setting, form in itertools.product(expressible(episode), FORMS):
        for options in options_of(setting, episode):
            yield setting, form, options


def rotating_variants(episode: Episode) -> Iterator[Variant]:
    """Every setting and form; the options take turns from one block of episodes to the next."""
    for setting in expressible(episode):
        options = list(options_of(setting, episode))
        for form in FORMS:
            yield setting, form, options[episode.index // len(CYCLE) % len(options)]


def default_variants(episode: Episode) -> Iterator[Variant]:
    """Every setting and form with the default options."""
    for setting, form in itertools.product(expressible(episode), FORMS):
        yield setting, form, {}
