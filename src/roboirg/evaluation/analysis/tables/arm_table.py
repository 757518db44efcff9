"""Table of what control arms show, and its comparison of two policies in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
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
from roboirg.evaluation.analysis.stats.chance import silent_chance
from roboirg.evaluation.analysis.stats.intervals import SEED, Interval
from roboirg.evaluation.analysis.stats.measure import pair
from roboirg.evaluation.analysis.stats.paired_tests import Gap, holm, measure_gap
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
    "words. Differences are in points; p-values are corrected over all rows of the policy. "
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
    names = {**labels(one.policy_run for one in found), **data.told.frame.names}
    return Table(
        key="arms",
        title="Control arms",
        heads=("policy and setting", "figure"),
        columns=named_columns(
            "episodes", "first, %", "second, %", "chance", "difference", "95 % interval", "p"
        ),
        rows=tuple(
            Row(
                f"{names[one.policy_run]}, {options_label(one.options)}",
                f"{one.contrast.name}: {one.contrast.first} − {one.contrast.second}",
                _words(one),
            )
            for one in found
        ),
        notes=(_NOTE,),
    )


def language_use_sentences(first: Frame, second: Frame, names: tuple[str, str]) -> Iterator[str]:
    """Yield how the language use of two policies differs, a sentence for each setting.

    P-values are corrected over the settings.
    """
    rng = np.random.default_rng(SEED)
    ours, theirs = (
        {of.options: of.cells[0] for of in arm_figures(one) if of.contrast.name == LANGUAGE_USE}
        for one in (first, second)
    )
    gaps: dict[InstructionOptions, Gap] = {}
    for options, here in ours.items():
        if (gap := measure_gap(pair(here, theirs.get(options, {})), rng)) is not None:
            gaps[options] = gap
    corrected = holm([gap.p_value for gap in gaps.values()])
    for (options, gap), p_value in zip(gaps.items(), corrected, strict=True):
        yield (
            f"Language use, {options_label(options)}: {names[0]} less {names[1]} "
            f"{points(gap.value, 1)} points{interval_note(gap.interval)}, {p_text(p_value)}, "
            f"{gap.episodes} scenes."
        )


def _words(one: ArmFigure) -> Sequence[str]:
    rates = [_rate_text(*side) for side in zip(one.rates, one.intervals, strict=True)]
    chance = NOT_APPLICABLE
    if one.contrast.name == WORDS_WORTH:
        split = one.policy_run.conditions.split
        chances = [
            np.mean([silent_chance(task, split, trial.episode) for trial in silent.verdicts])
            for task, silent in one.cells[1].items()
        ]
        chance = f"{100 * float(np.mean(chances)):.1f}"
    return (str(one.gap.episodes), *rates, chance, *gap_words(one.gap, one.p_holm))


def _rate_text(rate: float, interval: Interval | None) -> str:
    ends = "" if interval is None else f" ({100 * interval.low:.1f} to {100 * interval.high:.1f})"
    return f"{100 * rate:.1f}{ends}"
