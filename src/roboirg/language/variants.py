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
    """Yield all options with which an episode can be instructed: every setting, form and variant.

    A setting that cannot express the episode with some options is left out with these.

    Args:
        episode: to instruct.
        wordings: a pool of words, or the identity of an open wording file; None for the usual
            words.
    """
    for name in settings_of(get_task(episode.task)):
        plain_options = InstructionOptions(name, wordings=wordings)
        expressible: list[InstructionOptions] = []
        for changes in all_settings()[name].variants:
            options = replace(plain_options, **changes)
            if find_refusal(episode, options) is None:
                expressible.append(options)
        for form in FORMS:
            for options in expressible:
                yield replace(options, form=form)


def instructions(
    episodes: Iterable[Episode],
    settings: Sequence[str],
    forms: Sequence[str],
    options: InstructionOptions = InstructionOptions(),  # noqa: B008 - immutable
) -> Iterator[tuple[Episode, Instruction]]:
    """Yield each episode with its instructions in every wanted setting and form.

    Leaves out a setting that the task lacks, or that cannot express the episode.

    Args:
        episodes: to instruct.
        settings: their names.
        forms: ``implicit`` or ``resolved``, or both.
        options: for all else, such as the pool of words.
    """
    for episode in episodes:
        present = [name for name in settings if name in settings_of(get_task(episode.task))]
        for setting, form in itertools.product(present, forms):
            wanted = replace(options, setting=setting, form=form)
            if find_refusal(episode, wanted) is None:
                yield episode, instruct_with(episode, wanted)
