"""The headline number: the mean gap to explicit over the settings that words alone do not solve."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from roboirg.core.plain_text import counted
from roboirg.evaluation.analysis.results.frame import RunNames
from roboirg.evaluation.analysis.results.option_labels import reference_of
from roboirg.evaluation.analysis.results.policy_run import PolicyRun
from roboirg.evaluation.analysis.stats.cells import Cell, Cells
from roboirg.evaluation.analysis.stats.intervals import (
    SEED,
    Draws,
    Interval,
    Rows,
    resampled_interval,
    resampled_rates,
)
from roboirg.evaluation.analysis.stats.measured_floors import measured_floors, settings_at_chance
from roboirg.evaluation.analysis.stats.paired_tests import Pairs
from roboirg.evaluation.analysis.stats.rates import interval_note, points
from roboirg.language.settings import EXPLICIT


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

    For a run in words whose floors were not measured, the sentence gives the reason.
    """
    for policy_run, name in names.items():
        floors = measured_floors(policy_run.language)
        # Without floors, any setting next to explicit is reason enough to say why there is none.
        played = {key.options.setting for key in cells if key.policy_run == policy_run}
        wanted = settings_at_chance(floors) if floors else tuple(played - {EXPLICIT})
        found = measure_headline(cells, policy_run, wanted)
        if found is None:
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
        elif found.interval is None:
            yield (
                f"{name} has no headline number: {counted(found.episodes, 'episode')} cannot give "
                "it an interval; play more."
            )
        else:
            yield f"Headline of {name}: {found.text}."


def measure_headline(
    cells: Cells, policy_run: PolicyRun, settings: Sequence[str]
) -> Headline | None:
    """Return the headline number; None unless all settings were played next to explicit."""
    played = []
    rows = []
    for key, explicit in cells.items():
        if key.policy_run == policy_run and key.options == reference_of(key.options):
            words = [replace(key.options, setting=setting) for setting in settings]
            own = [cells.get(key._replace(options=options), Cell()) for options in words]
            played += [explicit, *own]
            paired = _paired_rows(own, explicit)
            if len(paired):
                rows.append(paired)
    if not settings or not rows or not np.concatenate(rows)[:, 1::4].any(axis=0).all():
        return None
    rng = np.random.default_rng(SEED)
    sizes = [len(one) for one in rows]
    # Resampling equal rows only gives the rates themselves.
    value = _mean_gap([resampled_rates([one.sum(axis=0)[None]], rng, 1) for one in rows])
    drawn = _mean_gap([resampled_rates([one], rng) for one in rows])
    interval = resampled_interval(drawn, sizes, least=-1.0)
    is_complete = not any(cell.errors or cell.missing for cell in played)
    return Headline(tuple(settings), float(value[0]), interval, sum(sizes), is_complete)


def _paired_rows(settings: Sequence[Cell], explicit: Cell) -> Rows:
    """Return a row for each episode of a task: the columns of `Pairs.rows` for each setting.

    They are 0 where the setting has no verdict.
    """
    reference = explicit.by_episode()
    places = {episode: place for place, episode in enumerate(sorted(reference))}
    rows = np.zeros((len(places), 4 * len(settings)), dtype=np.int64)
    for column, cell in enumerate(settings):
        shared = sorted(cell.by_episode().keys() & reference.keys())
        at = [places[episode] for episode in shared]
        rows[at, 4 * column : 4 * column + 4] = Pairs.of(cell, explicit).rows
    return rows[rows.any(axis=1)]


def _mean_gap(rates: Sequence[Draws]) -> Draws:
    """Return the mean gap of each resample, over settings, and before that over their tasks.

    Args:
        rates: for each task the rates of each setting and of explicit, shape (draws, 2 k).
    """
    gaps = np.stack([one[:, 0::2] - one[:, 1::2] for one in rates])
    tasks = (~np.isnan(gaps)).sum(axis=0)
    with np.errstate(invalid="ignore"):
        return np.asarray((np.nansum(gaps, axis=0) / tasks).mean(axis=1))
