"""The table of ``roboirg language shortcuts``: how much of each setting shortcuts solve."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from rich.table import Table

from roboirg.core.episode import Episode, Split
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.settings import EXPLICIT
from roboirg.language.variants import instructions
from roboirg.shortcuts.learned_floor import LearnedFloor
from roboirg.shortcuts.shortcut_scores import (
    Grouping,
    ShortcutScore,
    ShortcutShares,
    Told,
    group_told,
    mean_shares,
    rule_scorers,
)
from roboirg.tasks.splits.splits import get_episode, split_episodes

TRAINING_SPLIT: Split = "train"
LEARNED_EXPLICIT = "learned from explicit"
LEARNED_SETTING = "learned from the setting"

Group = tuple[str, ...]
"""A setting, and within it a reasoning pattern or task if the table has a row for each."""


@dataclass(frozen=True, slots=True)
class ShortcutRow:
    """One row of the table.

    Attributes:
        group: what the row is about.
        count: number of instructions.
        shares: by shortcut, in the order of the columns.
    """

    group: Group
    count: int
    shares: Mapping[str, ShortcutShares]


def shortcut_rows(
    tasks: Sequence[str],
    splits: Sequence[Split],
    settings: Sequence[str],
    options: InstructionOptions,
    *,
    seeds: int = 0,
    by: Grouping | None = None,
    learned: bool = False,
) -> list[ShortcutRow]:
    """Score all shortcuts on the instructions of some splits, and of random scenes.

    Args:
        tasks: names.
        splits: names.
        settings: names.
        options: all others, and the form.
        seeds: number of random scenes for each task, beyond the splits.
        by: what to break each setting down by.
        learned: whether to train the learned floors, on the train split with the same options.
    """
    if seeds < 0:
        raise InvalidValueError(f"The number of random seeds is {seeds}; it must be at least 0.")
    random = (get_episode(task, "random", index) for task in tasks for index in range(seeds))
    episodes = itertools.chain(split_episodes(tasks, splits), random)
    told = list(_told(episodes, settings, options))
    scores = {
        name: {_key(one): score(one) for one in told} for name, score in rule_scorers().items()
    }
    if learned:
        scores |= _learned_scores(tasks, settings, options, told)
    return [
        ShortcutRow(
            group,
            len(members),
            {
                name: mean_shares([found[_key(one)] for one in members])
                for name, found in scores.items()
            },
        )
        for group, members in group_told(told, by).items()
    ]


def _told(
    episodes: Iterable[Episode], settings: Sequence[str], options: InstructionOptions
) -> Iterator[Told]:
    """Yield the instructions, setting by setting."""
    yield from sorted(
        instructions(episodes, settings, (options.form,), options),
        key=lambda one: settings.index(one[1].setting),
    )


def _key(told: Told) -> tuple[str, str]:
    episode, instruction = told
    return episode.key, instruction.setting


def _learned_scores(
    tasks: Sequence[str],
    settings: Sequence[str],
    options: InstructionOptions,
    told: Sequence[Told],
) -> dict[str, dict[tuple[str, str], ShortcutScore]]:
    """Return the scores of the floors learned from explicit, and from each setting itself."""
    scores: dict[str, dict[tuple[str, str], ShortcutScore]] = {
        LEARNED_EXPLICIT: {},
        LEARNED_SETTING: {},
    }
    for task in tasks:
        seen = list(split_episodes((task,), (TRAINING_SPLIT,)))
        plain = replace(options, form="implicit")
        explicit = LearnedFloor(list(_told(seen, (EXPLICIT,), plain)))
        for setting in settings:
            tested = [one for one in told if (one[0].task, one[1].setting) == (task, setting)]
            if not tested:
                continue
            own = LearnedFloor(list(_told(seen, (setting,), options)))
            for name, floor in ((LEARNED_EXPLICIT, explicit), (LEARNED_SETTING, own)):
                found = floor.scores(tested)
                scores[name] |= {_key(one): score for one, score in zip(tested, found, strict=True)}
    return scores


def shortcut_table(rows: Sequence[ShortcutRow], title: str, by: Grouping | None = None) -> Table:
    """Return the rows as a table for the terminal: hidden slots, and whole goals, in percent."""
    table = Table(title=title, title_justify="left", title_style="bold", caption_justify="left")
    table.caption = "Percent of hidden slots right / of whole goals right."
    for head in ("setting", *((by,) if by else ())):
        table.add_column(head)
    for head in ("texts", *(rows[0].shares if rows else ())):
        table.add_column(head, justify="right")
    for row in rows:
        table.add_row(*row.group, str(row.count), *(_cell(one) for one in row.shares.values()))
    return table


def _cell(shares: ShortcutShares) -> str:
    slots = "–" if shares.slots is None else f"{100 * shares.slots:.0f}"
    return f"{slots} / {100 * shares.goals:.0f}"
