"""The table of ``roboirg language shortcuts``: how much of each setting shortcuts solve."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from statistics import NormalDist
from typing import Literal, NamedTuple, get_args

import numpy as np
from rich.table import Table

from roboirg.core.episode import Episode, Split
from roboirg.core.field_types import check_whole
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted
from roboirg.language.settings import settings_of
from roboirg.language.variants import instructions
from roboirg.shortcuts.goal_learner import LEARNED_FLOORS, GoalLearner, Heard, Told
from roboirg.shortcuts.shortcut_scores import (
    CHANCE,
    ShortcutScore,
    counted_slots,
    rule_scorers,
    score_guess,
)
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode, split_episodes

TRAINING_SPLIT: Split = "train"
JUDGING_SPLIT: Split = "val"
LEARNING_SCENES = 500
"""Random scenes of a task to learn from, beyond the train split."""
FIRST_LEARNED, FIRST_JUDGED = 500_000, 700_000
"""Numbers of the first random scene to learn from, and to choose on: none of them is tested."""
MARGIN = 0.05
"""By how much a floor may exceed chance before its setting counts as solved by it."""

Grouping = Literal["pattern", "task", "slot"]
GROUPINGS: tuple[Grouping, ...] = get_args(Grouping)
Group = tuple[str, ...]
"""A setting, and within it a reasoning pattern, task or slot if the table has a row for each."""
Scored = tuple[Told, Mapping[str, ShortcutScore]]
"""An instruction, and its score by shortcut."""
GroupsOf = Callable[[Told], Iterable[tuple[Group, Sequence[str]]]]
"""Returns the rows in which an instruction counts, and those of its slots that count there."""


class ShortcutShares(NamedTuple):
    """Mean scores over instructions.

    Attributes:
        slots: over all slots that count; None if there is none.
        goals: over all instructions.
    """

    slots: float | None
    goals: float


class Excess(NamedTuple):
    """By how much the learner of the words exceeds the larger of chance and the majority.

    Attributes:
        value: difference of the shares of slots, -1 to 1.
        error: its standard error, over instructions.
    """

    value: float
    error: float

    def interval(self, count: int) -> tuple[float, float]:
        """Return its interval, Bonferroni-adjusted for `count` of them.

        95 % of the time all of these are right.
        """
        reach = NormalDist().inv_cdf(1 - 0.025 / count) * self.error
        return self.value - reach, self.value + reach


@dataclass(frozen=True, slots=True)
class ShortcutRow:
    """One row of the table.

    Attributes:
        group: what the row is about.
        count: number of instructions.
        shares: by shortcut, in the order of the columns.
        excess: None without learned floors, or slots that count.
    """

    group: Group
    count: int
    shares: Mapping[str, ShortcutShares]
    excess: Excess | None = None


@dataclass(slots=True)
class _Tally:
    """Scores of the instructions of a row: by shortcut the sums over slots, and of goals."""

    sizes: list[int] = field(default_factory=list)
    slots: dict[str, list[float]] = field(default_factory=dict)
    goals: dict[str, list[float]] = field(default_factory=dict)

    def add(self, scores: Mapping[str, ShortcutScore], slots: Sequence[str]) -> None:
        self.sizes.append(len(slots))
        for name, score in scores.items():
            self.slots.setdefault(name, []).append(float(sum(score.slots[one] for one in slots)))
            self.goals.setdefault(name, []).append(float(score.goal))

    def row(self, group: Group) -> ShortcutRow:
        size = sum(self.sizes)
        shares = {
            name: ShortcutShares(
                # Shares are fractions; what floats add to their sum could change a rounding.
                round(sum(right) / size, 12) if size else None,
                round(sum(self.goals[name]) / len(self.sizes), 12),
            )
            for name, right in self.slots.items()
        }
        return ShortcutRow(group, len(self.sizes), shares, self._excess() if size else None)

    def _excess(self) -> Excess | None:
        if "text-only" not in self.slots:
            return None
        size = sum(self.sizes)
        least = max((CHANCE, "majority"), key=lambda name: sum(self.slots[name]))
        more = np.subtract(self.slots["text-only"], self.slots[least])
        value = float(more.sum()) / size
        # A ratio of sums. Two made-up texts, one right and one wrong, keep it above 0.
        rest = more - value * np.array(self.sizes)
        return Excess(value, float(np.sqrt((rest**2).sum() + 2)) / (size + 2))


def shortcut_rows(
    tasks: Sequence[str],
    splits: Sequence[Split],
    settings: Sequence[str],
    options: InstructionOptions,
    *,
    seeds: int = 0,
    by: Grouping | None = None,
    learning: int | None = None,
) -> list[ShortcutRow]:
    """Score all shortcuts on the instructions of some splits, and of random scenes.

    Args:
        tasks: names.
        splits: names.
        settings: names.
        options: all others, and the form.
        seeds: number of random scenes for each task, beyond the splits.
        by: what to break each setting down by.
        learning: number of random scenes of each task from which, and from the train split, the
            learned floors learn; None for no learned floors.
    """
    scored = score_texts(tasks, splits, settings, options, seeds=seeds, learning=learning)
    rows = tabulate(scored, lambda told: _groups_of(told, by))
    return sorted(rows, key=lambda row: settings.index(row.group[0]))


def tabulate(scored: Iterable[Scored], groups_of: GroupsOf) -> list[ShortcutRow]:
    """Return the rows of scored instructions, in the order in which their groups occur."""
    tallies: dict[Group, _Tally] = {}
    for told, scores in scored:
        for group, slots in groups_of(told):
            tallies.setdefault(group, _Tally()).add(scores, slots)
    return [tally.row(group) for group, tally in tallies.items()]


def _groups_of(told: Told, by: Grouping | None) -> Iterator[tuple[Group, Sequence[str]]]:
    episode, instruction = told
    slots = counted_slots(told)
    if by == "slot":
        for slot in slots:
            yield (instruction.setting, f"{episode.task} {slot}"), (slot,)
    elif by is None:
        yield (instruction.setting,), slots
    else:
        pattern = str(instruction.metadata["pattern"] or "–")
        yield (instruction.setting, pattern if by == "pattern" else episode.task), slots


def score_texts(
    tasks: Sequence[str],
    splits: Sequence[Split],
    settings: Sequence[str],
    options: InstructionOptions,
    *,
    seeds: int = 0,
    learning: int | None = None,
) -> Iterator[Scored]:
    """Yield every instruction with its scores, task by task; arguments as of `shortcut_rows`."""
    check_whole("seeds", seeds, least=0)
    for task in tasks:
        tested = [*split_episodes((task,), splits), *_random(task, 0, seeds)]
        for setting in (one for one in settings if one in settings_of(get_task(task))):
            told = _told(tested, setting, options)
            learned = [{} for _ in told] if learning is None else _learned(told, options, learning)
            for one, own in zip(told, learned, strict=True):
                yield one, {name: score(one) for name, score in rule_scorers().items()} | own


def _random(task: str, first: int, count: int) -> list[Episode]:
    return [get_episode(task, "random", first + index) for index in range(count)]


def _told(episodes: Iterable[Episode], setting: str, options: InstructionOptions) -> list[Told]:
    return list(instructions(episodes, (setting,), (options.form,), options))


def learn_goals(task: str, options: InstructionOptions, scenes: int) -> GoalLearner:
    """Return the floors that learn from the words of train, in the setting of `options`.

    What they learn from are the train split and random scenes; what is best is chosen on the val
    split and a quarter as many random scenes, in the words of test.
    """

    def said(split: Split, first: int, count: int, pool: str) -> list[Told]:
        episodes = itertools.chain(split_episodes((task,), (split,)), _random(task, first, count))
        wanted = replace(options, wordings=options.wordings or pool)
        return _told(episodes, options.setting, wanted)

    return GoalLearner(
        said(TRAINING_SPLIT, FIRST_LEARNED, scenes, "train"),
        said(JUDGING_SPLIT, FIRST_JUDGED, scenes // 4, "test"),
    )


def _learned(
    told: Sequence[Told], options: InstructionOptions, scenes: int
) -> list[dict[str, ShortcutScore]]:
    """Return the scores of the learned floors on instructions of one task and setting."""
    if not told:
        return []
    episode, instruction = told[0]
    learner = learn_goals(episode.task, replace(options, setting=instruction.setting), scenes)
    heard = [Heard.of(one) for one in told]
    scores: list[dict[str, ShortcutScore]] = [{} for _ in told]
    for floor in LEARNED_FLOORS:
        guesses = learner.guesses(floor, heard)
        for found, one, guess in zip(scores, told, guesses, strict=True):
            found[floor] = score_guess(guess, one)
    return scores


def shortcut_table(rows: Sequence[ShortcutRow], title: str, by: Grouping | None = None) -> Table:
    """Return the rows as a table for the terminal: slots that count, and goals, in percent."""
    table = Table(title=title, title_justify="left", title_style="bold", caption_justify="left")
    table.caption = "Percent of hidden slots right / of whole goals right."
    for head in ("setting", *((by,) if by else ())):
        table.add_column(head)
    for head in ("texts", *(rows[0].shares if rows else ())):
        table.add_column(head, justify="right")
    compared = [row.excess for row in rows if row.excess is not None]
    if compared:
        table.add_column("text-only over chance", justify="right")
        table.caption += (
            " Over chance: points of slots above the larger of chance and majority, with 95 % "
            f"intervals, Bonferroni-adjusted for {counted(len(compared), 'row')}."
        )
    for row in rows:
        cells = [_cell(one) for one in row.shares.values()]
        if compared:
            cells.append(excess_text(row.excess, len(compared)))
        table.add_row(*row.group, str(row.count), *cells)
    return table


def excess_text(excess: Excess | None, count: int) -> str:
    """Return an excess in points with its interval, Bonferroni-adjusted for `count` of them."""
    if excess is None:
        return "–"
    low, high = excess.interval(count)
    return " ".join(
        text.replace("-", "−")
        for text in (f"{100 * excess.value:+.1f}", f"({100 * low:+.1f} to {100 * high:+.1f})")
    )


def _cell(shares: ShortcutShares) -> str:
    slots = "–" if shares.slots is None else f"{100 * shares.slots:.0f}"
    return f"{slots} / {100 * shares.goals:.0f}"
