"""All instructions of an episode."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from roboirg.core.episode import Episode
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.generator import find_refusal, instruct_with
from roboirg.language.instruction import Instruction
from roboirg.language.settings import settings_of
from roboirg.tasks import get_task


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
