"""Table of what control arms show, and its comparison of two policies in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.results.frame import Frame
from roboirg.evaluation.analysis.results.option_labels import options_label
from roboirg.evaluation.analysis.results.policy_run import labels
from roboirg.evaluation.analysis.stats.arm_figures import (
    LANGUAGE_USE,
    MEANING,
    WORDS_WORTH,
    ArmFigure,
    arm_figures,
)
from roboirg.evaluation.analysis.stats.cells import ByTask
from roboirg.evaluation.analysis.stats.chance import silent_chance
from roboirg.evaluation.analysis.stats.intervals import TOO_FEW, Interval
from roboirg.evaluation.analysis.stats.measure import mean_rate, measure_groups
from roboirg.evaluation.analysis.stats.rates import (
    NOT_APPLICABLE,
    gap_words,
    interval_note,
    p_text,
    points,
)
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.table import Row, Table, named_columns

_NOTE = (
    "Each figure compares two rates on the same scenes, as means over tasks, in percent with 95 "
    f"% intervals. {MEANING} Chance is the success of pursuing a random goal of the scene without "
    "words. Differences are in points; p-values are after Holm's correction over all rows of the "
    "policy. "
    "Scenes without an arm are left out of its figures."
)


def make_arm_table(data: RunData) -> Table:
    """Make the table, one row for each figure of a policy in a setting.

    Raises:
        InvalidValueError: the runs have no control arms.
    """
    found = arm_figures(data.frame)
    if not found:
        raise InvalidValueError(
            "The runs have no control arms; play them with --arms told,other-goal,silent,scrambled."
        )
    names = {**labels(one.key.run for one in found), **data.told.frame.names}
    return Table(
        key="arms",
        title="Control arms",
        heads=("policy and setting", "figure"),
        columns=named_columns(
            "episodes", "first, %", "second, %", "chance", "difference", "95 % interval", "p"
        ),
        rows=[
            Row(
                f"{names[one.key.run]}, {options_label(one.key.options)}",
                f"{one.key.contrast.name}: {one.key.contrast.first} − {one.key.contrast.second}",
                _words(one),
            )
            for one in found
        ],
        notes=(_NOTE,),
    )


def language_use_sentences(first: Frame, second: Frame, names: tuple[str, str]) -> Iterator[str]:
    """Yield how the language use of two policies differs, a sentence for each setting.

    P-values are corrected over the settings.
    """
    ours, theirs = (
        {(one.key.options,): one.cells for one in own if one.key.contrast.name == LANGUAGE_USE}
        for own in map(arm_figures, (first, second))
    )
    found = measure_groups(ours, [lambda key: theirs.get(key, {})], with_intervals=False)
    for one in found:
        if one.gap is not None and one.p_holm is not None:
            gap = one.gap
            yield (
                f"Language use, {options_label(one.key[0])}: {names[0]} less {names[1]} "
                f"{points(gap.value, 1)} points{interval_note(gap.interval)}, "
                f"{p_text(one.p_holm)} after Holm's correction, {gap.episodes} scenes."
            )


def _words(one: ArmFigure) -> Sequence[str]:
    first = _rate_text(one.cells, one.interval)
    second = _rate_text(one.others, one.other_interval)
    chance = NOT_APPLICABLE
    if one.key.contrast.name == WORDS_WORTH:
        split = one.key.run.conditions.split
        chances = [
            np.mean([silent_chance(task, split, trial.episode) for trial in silent.verdicts])
            for task, silent in one.others.items()
        ]
        chance = f"{100 * float(np.mean(chances)):.1f}"
    episodes = one.gap.episodes if one.gap else 0
    return (str(episodes), first, second, chance, *gap_words(one.gap, one.p_holm))


def _rate_text(cells: ByTask, interval: Interval | None) -> str:
    ends = TOO_FEW
    if interval is not None:
        ends = f"{100 * interval.low:.1f} to {100 * interval.high:.1f}"
    return f"{100 * float(mean_rate(cells) or 0):.1f} ({ends})"
