"""Every variant there is, and every way in which one episode can be told."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from roboirg.core.episode import Episode, Split
from roboirg.episodes.splits import SIZES, get_episode
from roboirg.language.generator import can_express, expressible, instruct
from roboirg.language.instruction import FORMS, Form, Instruction
from roboirg.language.landmarks import FRAMES
from roboirg.language.settings import EXPLICIT, all_settings, settings_of
from roboirg.tasks import all_tasks, get_task


class Variant(NamedTuple):
    """A task in one of the settings that leave something implicit."""

    task: str
    setting: str


class Telling(NamedTuple):
    """One way to tell an episode: the arguments of `instruct`."""

    setting: str
    form: Form
    options: Mapping[str, Any]

    @property
    def implicit(self) -> bool:
        """Whether the command leaves something to its context."""
        return self.form == "implicit" and self.setting != EXPLICIT

    def of(self, episode: Episode) -> Instruction:
        """What is said in an episode."""
        return instruct(episode, self.setting, self.form, **self.options)


def all_variants() -> tuple[Variant, ...]:
    """Every variant of the benchmark, as the registry of tasks yields them."""
    return tuple(
        Variant(task.name, setting)
        for task in all_tasks().values()
        for setting in settings_of(task)
        if setting != EXPLICIT
    )


def tellings(episode: Episode) -> Iterator[Telling]:
    """Every setting, form and combination of options in which an episode can be told."""
    for name in settings_of(get_task(episode.task)):
        sayable = [
            options
            for options in all_settings()[name].variants
            if can_express(episode, name, **options)
        ]
        for form, options in itertools.product(FORMS, sayable):
            yield Telling(name, form, options)


def instructions(
    episodes: Iterable[Episode],
    settings: Sequence[str],
    forms: Sequence[str],
    **options: Any,  # noqa: ANN401 - those of `instruct`
) -> Iterator[tuple[Episode, Instruction]]:
    """Every episode in every wanted setting that can tell it, in every form.

    Args:
        episodes: what is told, in order.
        settings: names; a task has its own among them.
        forms: ``implicit``, ``resolved`` or both.
        options: of `instruct`.
    """
    frame = options.get("frame", FRAMES[0])
    for episode in episodes:
        sayable = expressible(episode, frame=frame)
        for setting, form in itertools.product(settings, forms):
            if setting in sayable:
                yield episode, instruct(episode, setting, form, **options)


def split_episodes(task: str, split: Split) -> Iterator[Episode]:
    """All episodes of a split of a task."""
    for index in range(SIZES[split]):
        yield get_episode(task, split, index)
