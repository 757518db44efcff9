"""The headline number: the mean gap to explicit over the settings that words alone do not solve.

These are the settings in which learners that see only the words were measured to be at chance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

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

    A run that played it and has no number gets the reason instead: no floors were measured in its
    version of the language, its words are others, or its episodes are too few.
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
    """Return the headline number; None unless all settings were played next to explicit.

    Args:
        cells: of all policy runs.
        policy_run: whose number it is.
        settings: over which the gap is the mean.
    """
    tasks = []
    is_complete = True
    for explicit, *others in _tasks_in_settings(cells, policy_run, settings):
        rows = _paired_rows(others, explicit)
        if len(rows):
            tasks.append(rows)
        if any(cell.errors or cell.missing for cell in (explicit, *others)):
            is_complete = False
    if not tasks or not _has_each_setting(tasks):
        return None

    rng = np.random.default_rng(SEED)
    # A resample of a single row, the sum of all episodes, gives the rates themselves.
    rates = [resampled_rates([rows.sum(axis=0)[None]], rng, draws=1) for rows in tasks]
    resampled = [resampled_rates([rows], rng) for rows in tasks]
    (gap,) = _mean_gap(rates)
    episodes = list(map(len, tasks))  # of each task
    interval = resampled_interval(_mean_gap(resampled), episodes, least=-1.0)
    return Headline(tuple(settings), float(gap), interval, sum(episodes), is_complete)


def _tasks_in_settings(
    cells: Cells, policy_run: PolicyRun, settings: Sequence[str]
) -> Iterator[list[Cell]]:
    """Yield for each task its cell in explicit, and then that in each of some settings.

    A cell is empty if the setting was not played.
    """
    for key, explicit in cells.items():
        if key.policy_run != policy_run or key.options != REFERENCE_OPTIONS:
            continue
        cells_of_task = [explicit]
        for setting in settings:
            options = replace(key.options, setting=setting)
            cells_of_task.append(cells.get(key._replace(options=options), Cell()))
        yield cells_of_task


def _has_each_setting(tasks: Sequence[Rows]) -> bool:
    """Return whether each setting has trials in some task, given the rows of `_paired_rows`."""
    # The second column of each setting counts its trials.
    trials = np.concatenate(tasks)[:, 1::_PAIR]
    return bool(trials.any(axis=0).all())


def _paired_rows(settings: Sequence[Cell], explicit: Cell) -> Rows:
    """Return a row for each episode of a task: the columns of `Pairs.rows` for each setting.

    They are 0 where the setting has no verdict; an episode without any is left out. Two settings,
    for example, have eight columns.
    """
    episodes = np.array(sorted(explicit.by_episode()))
    rows = np.zeros((len(episodes), _PAIR * len(settings)), dtype=np.int64)
    for number, cell in enumerate(settings):
        # Both are sorted by episode, as the rows of pairs are.
        is_shared = np.isin(episodes, list(cell.by_episode()))
        begin = _PAIR * number
        rows[is_shared, begin : begin + _PAIR] = Pairs.of(cell, explicit).rows
    return rows[rows.any(axis=1)]


def _mean_gap(rates: Sequence[Draws]) -> Draws:
    """Return the mean gap of each resample, over settings, and before that over their tasks.

    Args:
        rates: for each task the rates of each setting and of explicit, shape (draws, 2 k); nan
            where a task has no episode in a setting.
    """
    gaps = np.stack([task_rates[:, 0::2] - task_rates[:, 1::2] for task_rates in rates])
    tasks_with_gap = (~np.isnan(gaps)).sum(axis=0)
    with np.errstate(invalid="ignore"):
        gaps_of_settings = np.nansum(gaps, axis=0) / tasks_with_gap
    return np.asarray(gaps_of_settings.mean(axis=1))
