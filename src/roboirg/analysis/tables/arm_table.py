"""Table of what control arms show, and its comparison of two policies in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from roboirg.analysis.measures.arm_figures import (
    LANGUAGE_USE,
    MEANING,
    WORDS_WORTH,
    ArmFigure,
    arm_figures,
    silent_chance,
)
from roboirg.analysis.measures.measure import mean_rate, measure_groups
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.frame import Frame
from roboirg.analysis.results.policy_run import labels
from roboirg.analysis.tables.table import Row, Table, named_columns
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions, options_label
from roboirg.stats.cells import NOTHING, ByTask, rate_interval
from roboirg.stats.intervals import TOO_FEW, Interval
from roboirg.stats.rates import (
    NOT_APPLICABLE,
    gap_words,
    half_up,
    interval_note,
    p_text,
    points,
)

_NOTE = (
    "Each figure compares two rates on the same scenes, as means over tasks, in percent with 95 "
    f"% intervals. {MEANING} Chance is the success of pursuing a random goal of the scene without "
    "words. Differences are in points; p-values are after Holm's correction over all rows of the "
    "policy. "
    "Scenes without an arm are left out of its figures."
)


def make_arm_table(data: RunData) -> Table:
    """Make the table of what control arms show, a row for each figure of a policy in a setting.

    A control arm plays the same scenes with other words; a figure is the gap between two arms.

    Raises:
        InvalidValueError: the runs have no control arms.
    """
    figures = arm_figures(data.frame)
    if not figures:
        raise InvalidValueError(
            "The runs have no control arms; play them with --arms told,other-goal,silent,scrambled."
        )
    # Labels as in other tables, which leave out control arms; a policy that played arms alone is in
    # none of these.
    own_names = data.without_control_arms.frame.names
    names = {**labels(figure.key.run for figure in figures), **own_names}
    rows = []
    for figure in figures:
        key = figure.key
        contrast = key.contrast
        group = f"{names[key.run]}, {options_label(key.options)}"
        name = f"{contrast.name}: {contrast.first} − {contrast.second}"
        rows.append(Row(group, name, _words(figure)))
    return Table(
        key="arms",
        title="Control arms",
        heads=("policy and setting", "figure"),
        columns=named_columns(
            "episodes", "first, %", "second, %", "chance", "difference", "95 % interval", "p"
        ),
        rows=rows,
        notes=(_NOTE,),
    )


def language_use_sentences(first: Frame, second: Frame, names: tuple[str, str]) -> Iterator[str]:
    """Yield a sentence for each setting on which of two policies follows words to the goal more.

    Language use is the share of scenes in which a policy reached each of two goals when stated.
    P-values are corrected over the settings.

    Args:
        first: results of one policy.
        second: results of the other, which are subtracted.
        names: of both policies.
    """
    first_name, second_name = names
    subtracted = _language_use(second)
    compared = measure_groups(
        _language_use(first), lambda key: subtracted.get(key, NOTHING), with_intervals=False
    )
    for measured in compared:
        gap = measured.gap
        if gap is None or measured.p_holm is None:
            continue  # the two have no scenes in common
        (options,) = measured.key
        yield (
            f"Language use, {options_label(options)}: {first_name} less {second_name} "
            f"{points(gap.value, 1)} points{interval_note(gap.interval)}, "
            f"{p_text(measured.p_holm)} after Holm's correction, {gap.episodes} scenes."
        )


def _language_use(frame: Frame) -> dict[tuple[InstructionOptions], ByTask]:
    """Return, by instruction options, in which scenes a policy reached each of two goals.

    As cells by task: a success is a scene in which it reached each goal when stated.
    """
    results = {}
    for figure in arm_figures(frame):
        if figure.key.contrast.name == LANGUAGE_USE:
            results[(figure.key.options,)] = figure.cells
    return results


def _words(figure: ArmFigure) -> Sequence[str]:
    """Return the cells of a row: episodes, the two rates, the chance level, and their difference.

    Only the figure of what words are worth, success with them and without, has a chance level.
    """
    chance = NOT_APPLICABLE
    if figure.key.contrast.name == WORDS_WORTH:
        chance = _chance_text(figure)
    episodes = 0
    if figure.gap is not None:
        episodes = figure.gap.episodes
    return (
        str(episodes),
        _rate_text(figure.cells, figure.interval),
        _rate_text(figure.others, rate_interval(figure.others.values())),
        chance,
        *gap_words(figure.gap, figure.p_holm),
    )


def _chance_text(figure: ArmFigure) -> str:
    """Return the success, in percent, to expect of pursuing a random goal without words: ``33.3``.

    It is over the scenes that were played in silence, the figure's second rate, and the mean over
    tasks.
    """
    split = figure.key.run.conditions.split
    chances = []
    for task, silent in figure.others.items():
        scenes = [silent_chance(task, split, trial.episode) for trial in silent.verdicts]
        chances.append(np.mean(scenes))
    return str(half_up(100 * float(np.mean(chances)), 1))


def _rate_text(cells: ByTask, interval: Interval | None) -> str:
    """Return a rate with its interval in percent, such as ``50.0 (31.2 to 68.8)``."""
    ends = TOO_FEW
    if interval is not None:
        ends = f"{half_up(100 * interval.low, 1)} to {half_up(100 * interval.high, 1)}"
    return f"{half_up(100 * float(mean_rate(cells) or 0), 1)} ({ends})"
