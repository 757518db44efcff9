"""The study of learned listeners as tables and a figure."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from roboirg.apps.learning.listener.listener_study import HELD_OUT, TEST, VARIANTS, StudyAnswer
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.figures.figure_style import save
from roboirg.evaluation.analysis.figures.gaps import draw_gaps
from roboirg.evaluation.analysis.stats.cells import (
    CellKey,
    CellResults,
    Cells,
    EvalConditions,
    PolicyRun,
    Trial,
    Versions,
)
from roboirg.evaluation.analysis.stats.intervals import SEED
from roboirg.evaluation.analysis.stats.run_data import RunData, summaries_by_key
from roboirg.evaluation.analysis.stats.run_summary import ALL, SummaryRow, summarize
from roboirg.evaluation.analysis.tables.rendering.markdown import markdown
from roboirg.evaluation.analysis.tables.table import NOT_APPLICABLE, Column, Entry, Row, Table
from roboirg.language import LANGUAGE_VERSION
from roboirg.language.rivals import RIVAL_SETTINGS
from roboirg.language.settings import all_settings

FIGURE = "study"
_SECTIONS = (
    ("Held-out words", HELD_OUT, False),
    ("Words of the training pool", "train", False),
    ("Held-out words with rivals", HELD_OUT, True),
)
"""The title of each section, and its words: of which pool, and whether with a rival."""
_NOTE = (
    "Right answers in percent, and the 95 % interval: means over tasks, implicit form, test split."
)


def study_cells(answers: Iterable[StudyAnswer]) -> Cells:
    """Return answers as results of listeners, one policy run each."""
    verdicts: dict[CellKey, dict[Trial, bool]] = defaultdict(dict)
    versions = Versions("study", LANGUAGE_VERSION, ENVIRONMENT_VERSION)
    for one in answers:
        run = PolicyRun(one.listener, EvalConditions(TEST), versions)
        verdicts[CellKey(run, one.task, one.options)][Trial(one.episode, 0)] = one.is_right
    return {key: CellResults(own) for key, own in verdicts.items()}


def study_text(cells: Cells, about: Mapping[str, Any]) -> str:
    """Return the tables in Markdown.

    Args:
        cells: of the study.
        about: how the first listener was trained.
    """
    trained = ", ".join(f"{name} {value}" for name, value in about.items())
    parts = ["# What a listener learns", f"Trained with: {trained}."]
    parts += [markdown(table) for table in study_tables(cells)]
    parts.append(f"![Right answers by setting, held-out words]({FIGURE}.png)")
    return "\n\n".join(part.rstrip("\n") for part in parts) + "\n"


def study_tables(cells: Cells) -> Iterator[Table]:
    """Yield a table for each kind of words of the test split."""
    for title, pool, has_rival in _SECTIONS:
        own = _cells_of(cells, pool, has_rival=has_rival)
        found = {
            (one.policy_run.policy, one.options.setting): one
            for one in summarize(own, np.random.default_rng(SEED))
            if one.scope == ALL
        }
        settings = [name for name in all_settings() if any(key[1] == name for key in found)]
        if found:
            yield Table(
                key=title.lower().replace(" ", "-"),
                title=title,
                heads=("listener", ""),
                columns=tuple(map(Column, settings)),
                rows=tuple(_rows(found, settings)),
                notes=(_NOTE,),
            )


def save_study_figure(cells: Cells, folder: Path) -> tuple[Path, ...]:
    """Draw the means over tasks by setting, in held-out words, and write the files."""
    own = {
        key._replace(options=InstructionOptions(key.options.setting)): results
        for key, results in _cells_of(cells, HELD_OUT, has_rival=False).items()
    }
    names = {key.policy_run: key.policy_run.policy for key in own}
    content = RunData((), own, summaries_by_key(own), names)
    return save(lambda: draw_gaps(content), folder, FIGURE)


def _cells_of(cells: Cells, pool: str, *, has_rival: bool) -> Cells:
    return {
        key: results
        for key, results in cells.items()
        if key.options.wordings == pool and (key.options.setting in RIVAL_SETTINGS) == has_rival
    }


def _rows(found: Mapping[tuple[str, str], SummaryRow], settings: list[str]) -> Iterator[Row]:
    for variant in VARIANTS:
        name = variant.title
        own = [found.get((name, setting)) for setting in settings]
        yield Row(name, "right", "ours", tuple(Entry(word=_percent(one)) for one in own))
        yield Row(name, "interval", "ours", tuple(Entry(word=_interval(one)) for one in own))


def _percent(row: SummaryRow | None) -> str:
    return NOT_APPLICABLE if row is None or row.rate is None else f"{100 * float(row.rate):.1f}"


def _interval(row: SummaryRow | None) -> str:
    if row is None or row.interval is None:
        return NOT_APPLICABLE
    return " to ".join(f"{100 * end:.1f}" for end in row.interval)
