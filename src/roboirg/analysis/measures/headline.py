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
from roboirg.stats.intervals import Interval, Rows, Stratum, TaskRates, mean_interval
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
        interval: 95 %, over episodes, which all settings share; None with too few episodes.
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
        elif policy_run.is_until_decided:
            yield (
                f"{name} has no headline number: its run stopped when it was decided; play the "
                "whole plan for one."
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
    strata = _strata(rows_of_tasks)
    if not strata:
        return None
    return Headline(
        settings=tuple(settings),
        gap=sum(stratum.mean for stratum in strata),
        interval=mean_interval(strata),
        episodes=sum(map(len, rows_of_tasks)),
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
        return not any(cell.errors or cell.missing or cell.spared for cell in cells)


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


def _strata(tasks: Sequence[Rows]) -> list[Stratum]:
    """Return what each task adds to the headline number.

    The number is the mean over k settings of the gap to explicit, each the mean over the tasks that
    have the setting. With two settings, of which a task alone has the first one, that task's rates
    in it and in explicit count 1/2 and -1/2. Rates without trials are not counted.

    Args:
        tasks: for each task its results, as of `_paired_rows`.

    Returns:
        None of them if a setting has no trials in any task.
    """
    if not tasks:
        return []
    trials = np.array([rows.sum(axis=0)[1::2] for rows in tasks])
    # Of each setting, and of explicit next to it.
    tasks_with_trials = np.count_nonzero(trials, axis=0)
    if not tasks_with_trials.all():
        return []
    gaps = np.resize([1.0, -1.0], trials.shape)
    settings = trials.shape[1] / 2
    factors = gaps / tasks_with_trials / settings
    strata = []
    for rows, factors_of_task in zip(tasks, factors, strict=True):
        strata.append(TaskRates.of(rows).combined(*factors_of_task))
    return strata
