"""The study of learned listeners as tables."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.commands import write_atomically
from roboirg.extension.episodes import all_settings
from roboirg.extension.pages import ALPHA, interval_of_values, markdown_table
from roboirg_learn.listener.listener_study import HELD_OUT, RIVAL, VARIANTS, StudyAnswer


class _Section(NamedTuple):
    """A table of the page.

    Attributes:
        title: over the table.
        pool: of words, ``train`` or ``test``.
        has_rival: whether it shows the setting with a rival, a second object that the words could
            be mistaken to mean, or all others.
    """

    title: str
    pool: str
    has_rival: bool


_SECTIONS = (
    _Section("Held-out words", HELD_OUT, has_rival=False),
    _Section("Words of the training pool", "train", has_rival=False),
    _Section("Held-out words with rivals", HELD_OUT, has_rival=True),
)
_NO_RATE = "–"
"""In the place of a rate that there is not."""
_NOTE = (
    "Right answers in percent, with the 95 % interval over trainings and scenes: means over tasks "
    "and {}, implicit form, test split."
)

Verdicts = NDArray[np.float64]
"""Of one task: 1 where an answer is right, else 0; shape (training seeds, episodes)."""


class ListenerCell(NamedTuple):
    """A cell of the study's tables: a listener, a pool of words, and a setting."""

    listener: str
    pool: str
    setting: str


class TrainedRate(NamedTuple):
    """How often a listener is right, the mean over tasks; rates are from 0 to 1.

    Attributes:
        rate: the mean over all trainings.
        interval: its 95 % interval; None with too few scenes.
        by_seed: the rate of each training.
    """

    rate: float
    interval: tuple[float, float] | None
    by_seed: tuple[float, ...]


def trained_rate(tasks: Sequence[Verdicts]) -> TrainedRate:
    """Return the mean share of right answers over tasks, with its 95 % interval.

    The distance of an end has two parts whose squares add (MOVER: Zou and Donner, Statistics in
    Medicine 27, 2008): that of the score interval over scenes, and, with several trainings, which
    all answer the same instructions, that of Student's interval over trainings.

    Args:
        tasks: of each task 1 for a right answer, else 0: (training seeds, episodes).
    """
    by_seed = np.mean([verdicts.mean(axis=1) for verdicts in tasks], axis=0)
    rate = float(by_seed.mean())
    over_scenes = interval_of_values([verdicts.mean(axis=0) for verdicts in tasks])
    interval = None
    if over_scenes is not None:
        reach = _reach_of_trainings(by_seed)
        low, high = over_scenes
        interval = (
            max(0.0, rate - math.hypot(rate - low, reach)),
            min(1.0, rate + math.hypot(high - rate, reach)),
        )
    return TrainedRate(rate, interval, tuple(by_seed.tolist()))


def _reach_of_trainings(by_seed: Verdicts) -> float:
    """Return how far Student's interval over trainings reaches; 0 with a single one.

    Args:
        by_seed: (training seeds,) the rate of each.
    """
    seeds = len(by_seed)
    if seeds == 1:
        return 0.0
    from scipy import special  # SciPy's statistics take a second to import

    quantile = float(special.stdtrit(seeds - 1, 1 - ALPHA / 2))
    return quantile * float(by_seed.std(ddof=1)) / math.sqrt(seeds)


def write_study(answers: Iterable[StudyAnswer], about: Mapping[str, Any], folder: Path) -> Path:
    """Write the page of a study, ``study.md``, and return its path.

    Args:
        answers: of all listeners.
        about: how they were trained, for the head of the page.
        folder: of the study.
    """
    trained = ", ".join(f"{name} {value}" for name, value in about.items())
    parts = ["# What a listener learns", f"Trained with: {trained}."]
    parts.append(tables_text(study_rates(answers)))
    parts.append("Every answer: NAME-SEED.jsonl.")
    page = folder / "study.md"
    write_atomically(page, "\n\n".join(parts) + "\n")
    return page


def study_rates(answers: Iterable[StudyAnswer]) -> dict[ListenerCell, TrainedRate]:
    """Return how often each listener is right in each cell of the tables."""
    return {cell: trained_rate(tasks) for cell, tasks in _verdicts(answers).items()}


def tables_text(found: Mapping[ListenerCell, TrainedRate]) -> str:
    """Return the tables of a study as Markdown: rows of listeners, columns of settings."""
    seeds = max(len(rate.by_seed) for rate in found.values())
    trainings = "1 training seed" if seeds == 1 else f"{seeds} training seeds"
    note = _NOTE.format(trainings)
    tables = []
    for section in _SECTIONS:
        settings = _settings_of(section, found)
        if settings:
            rows = _rows(found, section.pool, settings)
            heads = ("listener", "")
            tables.append(markdown_table(section.title, settings, rows, (note,), heads=heads))
    return "\n\n".join(tables)


def _settings_of(section: _Section, found: Iterable[ListenerCell]) -> list[str]:
    """Return the settings that a table shows, in order; those without answers are left out."""
    answered = {cell.setting for cell in found if cell.pool == section.pool}
    settings = []
    for setting in all_settings():
        has_rival = setting == RIVAL
        if setting in answered and has_rival == section.has_rival:
            settings.append(setting)
    return settings


def _verdicts(answers: Iterable[StudyAnswer]) -> dict[ListenerCell, list[Verdicts]]:
    """Return for each cell of the tables one array for each task: 1 where an answer is right.

    An array is (training seeds, episodes); all seeds answered the same episodes in one order, so
    that a column is an episode.
    """
    lists: dict[tuple[ListenerCell, str], dict[int, list[bool]]] = defaultdict(dict)
    for answer in answers:
        cell = ListenerCell(answer.listener, answer.words, answer.setting)
        by_seed = lists[cell, answer.task]
        by_seed.setdefault(answer.seed, []).append(answer.is_right)
    verdicts: dict[ListenerCell, list[Verdicts]] = defaultdict(list)
    for (cell, _), by_seed in lists.items():
        verdicts[cell].append(np.array(list(by_seed.values()), float))
    return verdicts


def _rows(
    found: Mapping[ListenerCell, TrainedRate], pool: str, settings: Sequence[str]
) -> Iterator[tuple[str, str, list[str]]]:
    """Yield two rows for each listener: percent of right answers, and that of each seed.

    A row is the listener's title, what it shows, and a text for each setting.
    """
    for variant in VARIANTS:
        right = []
        by_seed = []
        for setting in settings:
            rate = found.get(ListenerCell(variant.name, pool, setting))
            right.append(_with_interval(rate))
            by_seed.append(_NO_RATE if rate is None else _percent(rate.by_seed))
        yield variant.title, "right", right
        yield variant.title, "by seed", by_seed


def _with_interval(rate: TrainedRate | None) -> str:
    """Return a rate in percent with its interval, as in "50.0 (40.0–60.0)"."""
    if rate is None:
        return _NO_RATE
    ends = "too few scenes"
    if rate.interval is not None:
        ends = _percent(rate.interval, "–")
    return f"{_percent([rate.rate])} ({ends})"


def _percent(rates: Iterable[float], between: str = ", ") -> str:
    """Return rates from 0 to 1 in percent, as in "50.0, 75.0"."""
    return between.join(f"{100 * rate:.1f}" for rate in rates)
