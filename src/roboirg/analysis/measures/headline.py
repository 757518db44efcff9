"""The headline number: the mean gap to explicit over the settings that words alone do not solve.

These are the settings in which learners that see only the words were measured to be at chance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from roboirg.analysis.measures.measured_floors import measured_floors, settings_at_chance
from roboirg.analysis.results.frame import RunNames
from roboirg.analysis.results.option_labels import REFERENCE_OPTIONS
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.analysis.results.run_cells import Cells
from roboirg.core.plain_text import counted
from roboirg.language.settings import EXPLICIT
from roboirg.stats.cells import Cell
from roboirg.stats.intervals import (
    SEED,
    Draws,
    Interval,
    Rows,
    rates_of,
    resampled_interval,
    resampled_rates,
)
from roboirg.stats.paired_tests import Pairs
from roboirg.stats.rates import interval_note, points

_PAIR = 4
"""Columns of a pair of cells, as in `Pairs.rows`: successes and trials of the first, then of the
second."""


@dataclass(frozen=True, slots=True)
class Headline:
    """The headline number of a policy run.

    Attributes:
        settings: over which the gap is the mean; a setting's is the mean over its tasks.
        gap: to explicit on the same episodes, -1 to 1.
        interval: from the paired bootstrap over episodes, which all settings share; None with too
            few episodes.
        episodes: number of episodes.
        is_complete: whether every planned trial of these cells has a verdict.
    """

    settings: tuple[str, ...]
    gap: float
    interval: Interval | None
    episodes: int
    is_complete: bool

    @property
    def text(self) -> str:
        """The number, its interval, and what it is over."""
        partial = "" if self.is_complete else ", incomplete"
        return (
            f"{points(self.gap, 1)} points to explicit{interval_note(self.interval)}, the mean "
            f"over the settings that words alone do not solve: {', '.join(self.settings)}; "
            f"{counted(self.episodes, 'episode')}{partial}"
        )


def headline_notes(cells: Cells, names: RunNames) -> Iterator[str]:
    """Yield a sentence with the headline number of each policy run that played what it needs.

    The headline number is the mean gap to explicit instructions over the settings in which learners
    that see only the words were measured to be at chance; these measurements are the floors. A run
    without a number gets the reason instead: no floors were measured in its version of the
    language, its words are others, or its episodes are too few.
    """
    for policy_run, name in names.items():
        floors = measured_floors(policy_run.language)
        if floors:
            settings = settings_at_chance(floors)
        else:
            # Any setting next to explicit is reason enough to say why there is no number.
            played = {key.options.setting for key in cells if key.policy_run == policy_run}
            settings = tuple(played - {EXPLICIT})
        headline = measure_headline(cells, policy_run, settings)
        if headline is None:
            continue
        if not floors:
            yield (
                f"{name} has no headline number: no floors were measured for its language version "
                f"{policy_run.language}."
            )
        elif policy_run.conditions.wordings is not None:
            yield (
                f"{name} has no headline number: the floors are those of our own words of each "
                f"split, and it was played in {policy_run.conditions.text('wordings')}."
            )
        elif headline.interval is None:
            episodes = counted(headline.episodes, "episode")
            yield (
                f"{name} has no headline number: {episodes} cannot give it an interval; play more."
            )
        else:
            yield f"Headline of {name}: {headline.text}."


def measure_headline(
    cells: Cells, policy_run: PolicyRun, settings: Sequence[str]
) -> Headline | None:
    """Return the mean gap of success in some settings to success in explicit, which names the goal.

    Rates are compared on the same episodes. None unless all settings were played next to explicit.

    Args:
        cells: of all policy runs.
        policy_run: whose number it is.
        settings: over which the gap is the mean.
    """
    tasks = list(_tasks_in_settings(cells, policy_run, settings))
    rows_of_tasks = [rows for rows in map(_paired_rows, tasks) if len(rows)]
    if not rows_of_tasks:
        return None
    # As measured: a single "draw" of all episodes, shape (1,).
    gap = _mean_gap([rates_of(rows.sum(axis=0, keepdims=True)) for rows in rows_of_tasks])
    if np.isnan(gap):
        return None  # a setting has no trials in any task

    rng = np.random.default_rng(SEED)
    resampled_gaps = _mean_gap([resampled_rates([rows], rng) for rows in rows_of_tasks])
    episodes = list(map(len, rows_of_tasks))  # of each task
    return Headline(
        settings=tuple(settings),
        gap=float(gap[0]),
        interval=resampled_interval(resampled_gaps, episodes, least=-1.0),
        episodes=sum(episodes),
        is_complete=all(task.is_complete for task in tasks),
    )


class _TaskCells(NamedTuple):
    """The cells of a task.

    Attributes:
        explicit: that in explicit.
        in_settings: one for each other setting, empty if it was not played.
    """

    explicit: Cell
    in_settings: list[Cell]

    @property
    def is_complete(self) -> bool:
        """Whether every planned trial has a verdict."""
        cells = (self.explicit, *self.in_settings)
        return not any(cell.errors or cell.missing for cell in cells)


def _tasks_in_settings(
    cells: Cells, policy_run: PolicyRun, settings: Sequence[str]
) -> Iterator[_TaskCells]:
    """Yield, for each task that a policy run played in explicit, its cells there and in settings.

    Explicit is the setting that names the goal, to which the others are compared.
    """
    for key, explicit in cells.items():
        if key.policy_run != policy_run or key.options != REFERENCE_OPTIONS:
            continue
        in_settings = []
        for setting in settings:
            options = replace(key.options, setting=setting)
            in_settings.append(cells.get(key._replace(options=options), Cell()))
        yield _TaskCells(explicit, in_settings)


def _paired_rows(task: _TaskCells) -> Rows:
    """Return the results of a task in k settings next to explicit, shape (episodes, 4 k).

    Each setting has four columns: its successes and trials in the episode, then those in explicit.
    All four are 0 where the setting has no verdict; an episode without any is left out.
    """
    episodes = np.array(sorted(task.explicit.by_episode()))
    rows = np.zeros((len(episodes), _PAIR * len(task.in_settings)), dtype=np.int64)
    for number, cell in enumerate(task.in_settings):
        # Both are sorted by episode, as the rows of pairs are.
        is_shared = np.isin(episodes, list(cell.by_episode()))
        begin = _PAIR * number
        rows[is_shared, begin : begin + _PAIR] = Pairs.of(cell, task.explicit).rows
    return rows[rows.any(axis=1)]


def _mean_gap(rates: Sequence[Draws]) -> Draws:
    """Return the gap to explicit in each draw, the mean over tasks and then over k settings.

    Args:
        rates: for each task the rates in each setting and in explicit, one next to the other, shape
            (draws, 2 k); nan where a task has no episode in a setting.

    Returns:
        Shape (draws,); nan if a setting has no episode in any task.
    """
    # Shape (tasks, draws, k).
    gaps = np.stack([task_rates[:, 0::2] - task_rates[:, 1::2] for task_rates in rates])
    tasks_with_gap = (~np.isnan(gaps)).sum(axis=0)
    with np.errstate(invalid="ignore"):
        gaps_of_settings = np.nansum(gaps, axis=0) / tasks_with_gap
    return np.asarray(gaps_of_settings.mean(axis=1))
