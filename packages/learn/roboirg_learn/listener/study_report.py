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
from roboirg.extension.pages import markdown_table, without_spread
from roboirg_learn.listener.listener_study import HELD_OUT, RIVAL, VARIANTS, StudyAnswer

_SECTIONS = (
    ("Held-out words", HELD_OUT, False),
    ("Words of the training pool", "train", False),
    ("Held-out words with rivals", HELD_OUT, True),
)
"""The title of each section, and its words: of which pool, and whether with a rival."""
_NOTE = (
    "Right answers in percent, with the 95 % interval over trainings and scenes: means over tasks "
    "and {}, implicit form, test split."
)

Verdicts = NDArray[np.float64]
"""Of one task: 1 where an answer is right, else 0; shape (training seeds, episodes)."""
ListenerCell = tuple[str, str, str]
"""Listener, pool of words, setting."""


class TrainedRate(NamedTuple):
    """How often a listener is right, the mean over tasks: of all trainings, and of each."""

    rate: float
    interval: tuple[float, float]
    by_seed: tuple[float, ...]


def trained_rate(tasks: Sequence[Verdicts]) -> TrainedRate:
    """Return the mean of tasks with its interval.

    The interval adds the variance between trainings, which all answer the same instructions, to
    that between scenes within tasks. It is Student's with Satterthwaite's degrees of freedom, so
    that few trainings that differ make it long; with a single one it is over scenes only.
    """
    by_seed = np.mean([one.mean(axis=1) for one in tasks], axis=0)
    rate, seeds, sizes = float(by_seed.mean()), len(by_seed), [one.shape[1] for one in tasks]
    trainings = float(by_seed.var(ddof=1)) / seeds if seeds > 1 else 0.0
    apart = [float(one.mean(axis=0).var()) / max(1, one.shape[1] - 1) for one in tasks]
    scenes = sum(apart) / len(tasks) ** 2
    interval: tuple[float, float] = without_spread(rate, sum(sizes))
    if variance := trainings + scenes:
        from scipy import special  # SciPy's statistics take a second to import

        parts = trainings**2 / max(1, seeds - 1) + scenes**2 / max(1, sum(sizes) - len(sizes))
        half = float(special.stdtrit(variance**2 / parts, 0.975)) * math.sqrt(variance)
        interval = max(0.0, rate - half), min(1.0, rate + half)
    return TrainedRate(rate, interval, tuple(by_seed.tolist()))


def write_study(answers: Iterable[StudyAnswer], about: Mapping[str, Any], folder: Path) -> Path:
    """Write the page of a study, and return its path."""
    trained = ", ".join(f"{name} {value}" for name, value in about.items())
    parts = ["# What a listener learns", f"Trained with: {trained}."]
    parts += [tables_text(study_rates(answers))]
    parts.append("Every answer: NAME-SEED.jsonl.")
    page = folder / "study.md"
    write_atomically(page, "\n\n".join(parts) + "\n")
    return page


def study_rates(answers: Iterable[StudyAnswer]) -> dict[ListenerCell, TrainedRate]:
    """Return how often each listener is right."""
    return {cell: trained_rate(tasks) for cell, tasks in _verdicts(answers).items()}


def tables_text(found: Mapping[ListenerCell, TrainedRate]) -> str:
    """Return a table for each kind of words as Markdown."""
    seeds = max(len(one.by_seed) for one in found.values())
    note = _NOTE.format(f"{seeds} training seed{'s' * (seeds > 1)}")
    shown = []
    for title, pool, has_rival in _SECTIONS:
        asked = {setting for _, words, setting in found if words == pool}
        names = [one for one in all_settings() if one in asked and (one == RIVAL) == has_rival]
        if names:
            shown.append(
                markdown_table(
                    title, names, _rows(found, pool, names), (note,), heads=("listener", "")
                )
            )
    return "\n\n".join(shown)


def _verdicts(answers: Iterable[StudyAnswer]) -> dict[ListenerCell, list[Verdicts]]:
    """Return the verdicts of each cell by task."""
    found: dict[tuple[ListenerCell, str], dict[int, list[bool]]] = defaultdict(dict)
    for one in answers:
        trained = found[(one.listener, one.words, one.setting), one.task]
        trained.setdefault(one.seed, []).append(one.is_right)
    cells: dict[ListenerCell, list[Verdicts]] = defaultdict(list)
    for (cell, _), trained in found.items():
        cells[cell].append(np.array(list(trained.values()), float))
    return cells


def _rows(
    found: Mapping[ListenerCell, TrainedRate], pool: str, settings: Sequence[str]
) -> Iterator[tuple[str, str, list[str]]]:
    for variant in VARIANTS:
        own = [found.get((variant.name, pool, setting)) for setting in settings]
        right = [
            f"{_percent([one.rate])} ({_percent(one.interval, '–')})" if one else "–" for one in own
        ]
        yield variant.title, "right", right
        yield variant.title, "by seed", [_percent(one.by_seed) if one else "–" for one in own]


def _percent(rates: Iterable[float], between: str = ", ") -> str:
    return between.join(f"{100 * rate:.1f}" for rate in rates)
