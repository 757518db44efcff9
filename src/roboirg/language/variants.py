"""All instructions of an episode."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from roboirg.core.episode import Episode
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.generator import find_refusal, instruct_with
from roboirg.language.instruction import FORMS, Instruction
from roboirg.language.settings import all_settings, settings_of
from roboirg.tasks import get_task


def expressible_options(
    episode: Episode, wordings: str | None = None
) -> Iterator[InstructionOptions]:
    """Yield every setting, form and combination of options that can express an episode."""
    for name in settings_of(get_task(episode.task)):
        usual = InstructionOptions(name, wordings=wordings)
        possible: list[InstructionOptions] = []
        for changes in all_settings()[name].variants:
            options = replace(usual, **changes)
            if find_refusal(episode, options) is None:
                possible.append(options)
        for form in FORMS:
            for options in possible:
                yield replace(options, form=form)


def instructions(
    episodes: Iterable[Episode],
    settings: Sequence[str],
    forms: Sequence[str],
    options: InstructionOptions = InstructionOptions(),  # noqa: B008 - immutable
) -> Iterator[tuple[Episode, Instruction]]:
    """Yield the instructions of episodes in every wanted setting and form.

    Leaves out a setting that the task lacks, or that cannot express the episode.
    """
    for episode in episodes:
        present = [name for name in settings if name in settings_of(get_task(episode.task))]
        for setting, form in itertools.product(present, forms):
            wanted = replace(options, setting=setting, form=form)
            if find_refusal(episode, wanted) is None:
                yield episode, instruct_with(episode, wanted)
