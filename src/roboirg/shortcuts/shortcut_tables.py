"""The table of ``roboirg language shortcuts``: how much of each setting shortcuts solve.

A shortcut guesses goals without understanding: by chance, by a surface rule, or as a learned floor
(`goal_learner`). The table has a column for each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np
from rich.table import Table

from roboirg.core.episode import Episode, Split
from roboirg.core.field_types import check_whole
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted
from roboirg.language.settings import settings_of
from roboirg.language.variants import instructions
from roboirg.shortcuts.goal_learner import (
    LEARNED_FLOORS,
    GoalLearner,
    InstructedEpisode,
    LearnerInput,
)
from roboirg.shortcuts.shortcut_scores import (
    CHANCE,
    ShortcutScore,
    counted_slots,
    rule_scores,
    score_guess,
)
from roboirg.shortcuts.shortcut_shares import (
    FEWEST_TEXTS,
    Excess,
    Group,
    ShortcutRow,
    ShortcutShares,
)
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode, split_episodes

TRAINING_SPLIT: Split = "train"
"""The models of the learned floors are fitted on it."""
JUDGING_SPLIT: Split = "val"
"""The best models are chosen on it."""
LEARNING_SCENES = 500
"""Random scenes of a task to learn from, beyond the train split."""
FIRST_LEARNED = 500_000
"""Number of the first random scene to learn from; none of them is tested."""
FIRST_JUDGED = 700_000
"""The same for those on which the best learner is chosen."""
_MADE_UP_TEXTS = 2
"""Texts that are added, one right and one wrong, so that no standard error is 0."""

Grouping = Literal["pattern", "task", "slot"]
GROUPINGS: tuple[Grouping, ...] = get_args(Grouping)
Scored = tuple[InstructedEpisode, Mapping[str, ShortcutScore]]
"""An instruction with its episode, and its score by shortcut, such as ``chance``."""
GroupsOf = Callable[[InstructedEpisode], Iterable[tuple[Group, Sequence[str]]]]
"""Returns the rows in which an instruction counts, and for each its goal slots that count there."""


@dataclass(slots=True)
class _Tally:
    """Scores of the instructions of a row, which become their means.

    All lists have an entry for each instruction, in the same order.

    Attributes:
        slot_counts: how many slots of the instruction count in the row.
        slots_right: by shortcut, how many of these it guesses right.
        goals_right: by shortcut, the probability that the whole goal is right.
    """

    slot_counts: list[int] = field(default_factory=list)
    slots_right: dict[str, list[float]] = field(default_factory=dict)
    goals_right: dict[str, list[float]] = field(default_factory=dict)

    def add(self, scores: Mapping[str, ShortcutScore], slots: Sequence[str]) -> None:
        """Add the scores of one instruction.

        Args:
            scores: by shortcut, the same ones for every instruction.
            slots: the goal slots of the instruction that count in this row.
        """
        self.slot_counts.append(len(slots))
        for name, score in scores.items():
            right = sum(score.slots[slot] for slot in slots)
            self.slots_right.setdefault(name, []).append(float(right))
            self.goals_right.setdefault(name, []).append(float(score.goal))

    def row(self, group: Group) -> ShortcutRow:
        """Return the row of a group, with the mean scores of all instructions that were added."""
        slot_count = sum(self.slot_counts)
        text_count = len(self.slot_counts)
        shares = {}
        for name, right in self.slots_right.items():
            slots = _share(right, slot_count) if slot_count else None
            goals = _share(self.goals_right[name], text_count)
            shares[name] = ShortcutShares(slots, goals)
        return ShortcutRow(group, text_count, shares, self._excess())

    def _excess(self) -> Excess | None:
        """Return by how much a learner of the words exceeds the better of chance and majority.

        None if no slot counts or there are no learners. The value is a ratio of two sums over
        instructions: of the slots that the learner has more right, and of all slots. Its standard
        error is that of a ratio estimator: the root of the sum of squared residuals, by the number
        of slots.
        """
        slot_count = sum(self.slot_counts)
        if not slot_count or "text-only" not in self.slots_right:
            return None
        chance = self.slots_right[CHANCE]
        majority = self.slots_right["majority"]
        baseline = chance if sum(chance) >= sum(majority) else majority
        more_right = np.subtract(self.slots_right["text-only"], baseline)
        value = float(more_right.sum()) / slot_count
        residuals = more_right - value * np.array(self.slot_counts)
        # Made-up texts keep the error above 0 where all instructions agree.
        squares = (residuals**2).sum() + _MADE_UP_TEXTS
        return Excess(value, float(np.sqrt(squares)) / (slot_count + _MADE_UP_TEXTS))


def _share(right: Sequence[float], count: int) -> float:
    """Return the share of `count` slots or goals that is right: of (1, 0.5) and 2, it is 0.75.

    It is rounded to 12 digits, as the error of a sum of floats could change a later rounding.
    """
    return round(sum(right) / count, 12)


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
    """Return the table's rows, sorted by setting: the mean scores of all shortcuts.

    Args:
        tasks: names of the tasks.
        splits: names of the splits with the episodes.
        settings: names of the settings; those that a task does not have are left out.
        options: of the instructions, but for the setting.
        seeds: number of random scenes for each task, beyond the splits.
        by: what to break each setting down by, with a row for each; None for a row a setting.
        learning: number of random scenes of each task from which, and from the train split, the
            learned floors learn; None for no learned floors.
    """
    scored = score_texts(tasks, splits, settings, options, seeds=seeds, learning=learning)
    rows = tabulate(scored, lambda instructed: _groups_of(instructed, by))
    return sorted(rows, key=lambda row: settings.index(row.group[0]))


def tabulate(scored: Iterable[Scored], groups_of: GroupsOf) -> list[ShortcutRow]:
    """Return a row of mean scores for each group of instructions, in order of first occurrence.

    Args:
        scored: the instructions with their scores.
        groups_of: returns the rows in which an instruction counts, and for each the slots of its
            goal that count there: ``[(("direct",), ["color"])]``.
    """
    tallies: dict[Group, _Tally] = {}
    for instructed, scores in scored:
        for group, slots in groups_of(instructed):
            tallies.setdefault(group, _Tally()).add(scores, slots)
    return [tally.row(group) for group, tally in tallies.items()]


def _groups_of(
    instructed: InstructedEpisode, by: Grouping | None
) -> Iterator[tuple[Group, Sequence[str]]]:
    """Yield the rows in which an instruction counts, and for each its slots that count there.

    Without `by` it is one row, that of its setting: ``(("direct",), ("color", "repeats"))``. By
    ``task`` it is the row ``("direct", "PickXtimes")``. By ``slot`` there is a row for each slot
    that counts.
    """
    episode, instruction = instructed
    setting = instruction.setting
    slots = counted_slots(instructed)
    if by is None:
        yield (setting,), slots
    elif by == "task":
        yield (setting, episode.task), slots
    elif by == "pattern":
        yield (setting, str(instruction.metadata["pattern"] or "–")), slots
    else:
        for slot in slots:
            yield (setting, f"{episode.task} {slot}"), (slot,)


def score_texts(
    tasks: Sequence[str],
    splits: Sequence[Split],
    settings: Sequence[str],
    options: InstructionOptions,
    *,
    seeds: int = 0,
    learning: int | None = None,
) -> Iterator[Scored]:
    """Yield every instruction with its score by shortcut, task by task and setting by setting.

    Settings that a task does not have are left out. The arguments are those of `shortcut_rows`.
    With `learning`, floors are learned anew for each task and setting, which takes minutes.
    """
    check_whole("seeds", seeds, least=0)
    for task in tasks:
        tested = _episodes(task, splits, range(seeds))
        present = settings_of(get_task(task))
        for setting in settings:
            if setting in present:
                yield from _score_setting(task, tested, replace(options, setting=setting), learning)


def _score_setting(
    task: str, tested: Sequence[Episode], options: InstructionOptions, learning: int | None
) -> Iterator[Scored]:
    """Yield the instruction of each episode of a task in one setting, with its scores.

    `learning` is as in `shortcut_rows`.
    """
    texts = _instructed(tested, options)
    scores = [rule_scores(instructed) for instructed in texts]
    if learning is not None and texts:
        _add_learned(scores, texts, learn_goals(task, options, learning))
    yield from zip(texts, scores, strict=True)


def _episodes(task: str, splits: Sequence[Split], random_scenes: range) -> list[Episode]:
    """Return the episodes of a task in some splits, then its random ones of these numbers."""
    episodes = list(split_episodes((task,), splits))
    episodes += [get_episode(task, "random", number) for number in random_scenes]
    return episodes


def _instructed(
    episodes: Iterable[Episode], options: InstructionOptions
) -> list[InstructedEpisode]:
    """Return the instruction of each episode, paired with it, where the setting can express it."""
    return list(instructions(episodes, (options.setting,), (options.form,), options))


def learn_goals(task: str, options: InstructionOptions, scenes: int) -> GoalLearner:
    """Return the learned floors of a task, in the setting of `options`.

    Their models are fitted on the train split and random scenes, in the words of train. The best
    models are chosen on the val split and a quarter as many random scenes, in the words of test.

    Args:
        task: name of the task.
        options: of the instructions; a wording file in them replaces the words of train and test.
        scenes: number of random scenes to learn from.
    """
    to_learn = range(FIRST_LEARNED, FIRST_LEARNED + scenes)
    to_judge = range(FIRST_JUDGED, FIRST_JUDGED + scenes // 4)
    learned = _episodes(task, (TRAINING_SPLIT,), to_learn)
    judged = _episodes(task, (JUDGING_SPLIT,), to_judge)
    in_train = replace(options, wordings=options.wordings or "train")
    in_test = replace(options, wordings=options.wordings or "test")
    return GoalLearner(
        _instructed(learned, in_train),
        _instructed(judged, in_test),
    )


def _add_learned(
    scores: Sequence[dict[str, ShortcutScore]],
    texts: Sequence[InstructedEpisode],
    learner: GoalLearner,
) -> None:
    """Add the scores of the learned floors to those of each instruction.

    Args:
        scores: by shortcut, for each instruction; changed in place.
        texts: the instructions in the same order, all of the learner's task and setting.
        learner: of the floors.
    """
    inputs = [LearnerInput.of(pair) for pair in texts]
    for floor in LEARNED_FLOORS:
        guesses = learner.guesses(floor, inputs)
        for text_scores, instructed, guess in zip(scores, texts, guesses, strict=True):
            text_scores[floor] = score_guess(guess, instructed)


def _empty_table(title: str, by: Grouping | None, shortcuts: Iterable[str]) -> Table:
    """Return a table for the terminal with its columns, and without rows.

    Args:
        title: above it.
        by: heading of the second column; None for none.
        shortcuts: names, one for each further column.
    """
    table = Table(title=title, title_justify="left", title_style="bold", caption_justify="left")
    table.add_column("setting")
    if by is not None:
        table.add_column(by)
    table.add_column("texts", justify="right")
    for shortcut in shortcuts:
        table.add_column(shortcut, justify="right")
    return table


def shortcut_table(rows: Sequence[ShortcutRow], title: str, by: Grouping | None = None) -> Table:
    """Return a table for the terminal, with a column for each shortcut.

    Its cells are percents of slots and of whole goals that are right: ``44 / 43``.

    Args:
        rows: of the table.
        title: above it.
        by: what the second column groups by; None for none.
    """
    shortcuts = rows[0].shares if rows else {}
    table = _empty_table(title, by, shortcuts)
    table.caption = "Percent of hidden slots right / of whole goals right."
    with_excess = [row for row in rows if row.excess is not None]
    # The number of intervals that are shown, for which they are adjusted.
    compared = sum(row.count >= FEWEST_TEXTS for row in with_excess)
    if with_excess:
        table.add_column("text-only over chance", justify="right")
        table.caption += (
            " Over chance: points of slots above the larger of chance and majority, with 95 % "
            f"intervals, Bonferroni-adjusted for {counted(compared, 'row')}; rows of fewer than "
            f"{FEWEST_TEXTS} texts have none."
        )
    for row in rows:
        cells = [_cell(shares) for shares in row.shares.values()]
        if with_excess:
            has_interval = row.count >= FEWEST_TEXTS
            cells.append(excess_text(row.excess, compared if has_interval else 0))
        table.add_row(*row.group, str(row.count), *cells)
    return table


def excess_text(excess: Excess | None, count: int) -> str:
    """Return an excess over chance in percent points, with its 95 % interval.

    For example ``+53.1 (+47.8 to +58.5)``; ``–`` for None. The interval is Bonferroni-adjusted for
    `count` intervals that are shown together; 0 stands for too few texts for one.
    """
    if excess is None:
        return "–"
    interval = "too few texts"
    if count:
        low, high = excess.interval(count)
        interval = f"{100 * low:+.1f} to {100 * high:+.1f}"
    return f"{100 * excess.value:+.1f} ({interval})".replace("-", "−")


def _cell(shares: ShortcutShares) -> str:
    """Return shares of slots and of goals in percent: ``44 / 43``."""
    slots = "–" if shares.slots is None else f"{100 * shares.slots:.0f}"
    return f"{slots} / {100 * shares.goals:.0f}"
