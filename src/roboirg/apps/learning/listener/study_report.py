"""The study of learned listeners as tables and a figure."""

from __future__ import annotations

import csv
import io
import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.learning.listener.listener_study import HELD_OUT, RIVAL, VARIANTS, StudyAnswer
from roboirg.core.plain_text import counted
from roboirg.evaluation.analysis.figures.figure_style import save
from roboirg.evaluation.analysis.figures.rates import Rate, RateRow, draw_rates
from roboirg.evaluation.analysis.stats.intervals import ALPHA, Interval, without_spread
from roboirg.evaluation.analysis.stats.rates import NOT_APPLICABLE
from roboirg.evaluation.analysis.tables.rendering.markdown import markdown
from roboirg.evaluation.analysis.tables.table import Column, Row, Table
from roboirg.language.settings import all_settings
from roboirg.util.atomic_write import write_atomically

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURE, BY_TASK = "study", "by-task.csv"
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
    interval: Interval
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
    interval = without_spread(rate, sum(sizes))
    if variance := trainings + scenes:
        from scipy import special  # SciPy's statistics take a second to import

        parts = trainings**2 / max(1, seeds - 1) + scenes**2 / max(1, sum(sizes) - len(sizes))
        half = float(special.stdtrit(variance**2 / parts, 1 - ALPHA / 2)) * math.sqrt(variance)
        interval = Interval(max(0.0, rate - half), min(1.0, rate + half))
    return TrainedRate(rate, interval, tuple(by_seed.tolist()))


def write_study(answers: Iterable[StudyAnswer], about: Mapping[str, Any], folder: Path) -> Path:
    """Write the page of a study, its figure and its table by task; return the page."""
    answers = list(answers)
    found = study_rates(answers)
    trained = ", ".join(f"{name} {value}" for name, value in about.items())
    parts = ["# What a listener learns", f"Trained with: {trained}.", tables_text(found)]
    parts.append(f"![Right answers by setting, held-out words]({FIGURE}.png)")
    parts.append(f"By task: {BY_TASK}. Every answer: NAME-SEED.jsonl.")
    page = folder / "study.md"
    write_atomically(page, "\n\n".join(parts) + "\n")
    write_atomically(folder / BY_TASK, _by_task(answers))
    save(lambda: _draw(found), folder, FIGURE)
    return page


def study_rates(answers: Iterable[StudyAnswer]) -> dict[ListenerCell, TrainedRate]:
    """Return how often each listener is right."""
    return {cell: trained_rate(tasks) for cell, tasks in _verdicts(answers).items()}


def tables_text(found: Mapping[ListenerCell, TrainedRate]) -> str:
    """Return a table for each kind of words as Markdown."""
    return "\n\n".join(markdown(table).rstrip("\n") for table in _tables(found))


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


def _by_task(answers: Sequence[StudyAnswer]) -> str:
    """Return how many answers are right as CSV."""
    asked = Counter(one[:3] + one[4:6] for one in answers)
    right = Counter(one[:3] + one[4:6] for one in answers if one.is_right)
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["listener", "seed", "task", "setting", "words", "right", "answers"])
    rows.writerows([*key, right[key], count] for key, count in asked.items())
    return text.getvalue()


def _tables(found: Mapping[ListenerCell, TrainedRate]) -> Iterator[Table]:
    """Yield a table for each kind of words of the test split."""
    seeds = max(len(one.by_seed) for one in found.values())
    for title, pool, has_rival in _SECTIONS:
        settings = _settings(found, pool, has_rival=has_rival)
        if settings:
            yield Table(
                key=title.lower().replace(" ", "-"),
                title=title,
                heads=("listener", ""),
                columns=tuple(map(Column, settings)),
                rows=tuple(_rows(found, pool, settings)),
                notes=(_NOTE.format(counted(seeds, "training seed")),),
            )


def _settings(
    found: Mapping[ListenerCell, TrainedRate], pool: str, *, has_rival: bool
) -> list[str]:
    asked = {setting for _, words, setting in found if words == pool}
    return [one for one in all_settings() if one in asked and (one == RIVAL) == has_rival]


def _rows(
    found: Mapping[ListenerCell, TrainedRate], pool: str, settings: Sequence[str]
) -> Iterator[Row]:
    for variant in VARIANTS:
        own = [found.get((variant.name, pool, setting)) for setting in settings]
        cells = [
            (f"{_percent([one.rate])} ({_percent(one.interval, '–')})", _percent(one.by_seed))
            if one
            else (NOT_APPLICABLE,) * 2
            for one in own
        ]
        for name, words in zip(("right", "by seed"), zip(*cells, strict=True), strict=True):
            yield Row(variant.title, name, words)


def _percent(rates: Iterable[float], between: str = ", ") -> str:
    return between.join(f"{100 * rate:.1f}" for rate in rates)


def _draw(found: Mapping[ListenerCell, TrainedRate]) -> Figure:
    """Draw the means over tasks by setting, in held-out words."""
    settings = _settings(found, HELD_OUT, has_rival=False)
    rows = []
    for variant in VARIANTS:
        own = {setting: found.get((variant.name, HELD_OUT, setting)) for setting in settings}
        rates = {name: Rate(one.rate, None, one.interval) for name, one in own.items() if one}
        rows.append(RateRow(variant.title, rates))
    return draw_rates(dict.fromkeys(settings, "right, %"), rows, ("right", "", ""), [])
