"""What control arms show: each figure compares two rates over the same scenes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from roboirg.core.arms import (
    AGAIN,
    MOST_PARAPHRASES,
    OTHER_GOAL,
    SCRAMBLED,
    SILENT,
    SILENT_EMPTY,
    TOLD,
    paraphrase_number,
)
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.stats.cells import (
    CellResults,
    PolicyRun,
    Trial,
    clustered_interval,
    task_order,
)
from roboirg.evaluation.analysis.stats.intervals import Interval
from roboirg.evaluation.analysis.stats.option_labels import options_sort_key
from roboirg.evaluation.analysis.stats.paired_tests import Gap, Pairs, holm, measure_gap
from roboirg.evaluation.records.record import Summary

LANGUAGE_USE, WORDS_WORTH = "language use", "words' worth"

Arms = Mapping[str, Summary]
"""The verdicts of one trial by arm."""
Sides = tuple[Mapping[Trial, bool], Mapping[Trial, bool]]
"""What a trial counts in the first and in the second rate."""
SideCells = tuple[CellResults, CellResults]


class ArmContrast(NamedTuple):
    """One figure.

    Attributes:
        name: of the figure.
        first: what the first rate counts, in a word or two.
        second: what the second rate counts.
        sides: returns what a trial counts in each; None if it lacks an arm.
    """

    name: str
    first: str
    second: str
    sides: Callable[[Trial, Arms], Sides | None]


@dataclass(frozen=True, slots=True)
class ArmFigure:
    """A figure of one policy in one setting, the mean over tasks.

    Attributes:
        policy_run: as of the arm ``told``.
        options: of the instruction.
        contrast: which figure.
        cells: by task, those of the first and of the second rate.
        intervals: of the first and the second rate.
        gap: first less second.
        p_holm: its p-value after Holm's correction over all figures of the policy run.
    """

    policy_run: PolicyRun
    options: InstructionOptions
    contrast: ArmContrast
    cells: Mapping[str, SideCells]
    intervals: tuple[Interval | None, Interval | None]
    gap: Gap
    p_holm: float

    @property
    def rates(self) -> tuple[float, float]:
        """The first and the second rate, means over tasks."""
        first, second = (
            np.mean([float(cell.rate or 0) for cell in side])
            for side in zip(*self.cells.values(), strict=True)
        )
        return float(first), float(second)


def arm_figures(
    results: Iterable[tuple[PolicyRun, Summary]], rng: np.random.Generator
) -> tuple[ArmFigure, ...]:
    """Return the figures for which the arms were played, by policy run and setting."""
    trials: dict[tuple[PolicyRun, InstructionOptions], dict[str, dict[Trial, dict[str, Summary]]]]
    trials = defaultdict(lambda: defaultdict(lambda: defaultdict(dict)))
    for run, one in results:
        if one.outcome != "error":
            told = run._replace(conditions=run.conditions._replace(arm=TOLD))
            trial = Trial(one.episode, one.policy_seed)
            trials[told, one.column][one.task][trial][one.arm] = one
    found: dict[PolicyRun, list[ArmFigure]] = defaultdict(list)
    for run, options in sorted(trials, key=lambda key: options_sort_key(key[1])):
        tasks = {name: trials[run, options][name] for name in task_order(trials[run, options])}
        made = (_figure(run, options, each, tasks, rng) for each in CONTRASTS)
        found[run] += filter(None, made)
    runs = dict.fromkeys(run for run, _ in trials)
    return tuple(one for run in runs for one in _corrected(found[run]))


def compare_language_use(
    first: Iterable[ArmFigure], second: Iterable[ArmFigure], rng: np.random.Generator
) -> Mapping[InstructionOptions, tuple[Gap, float]]:
    """Return how the language use of two policies differs on the same episodes, by options.

    Each gap comes with its p-value after Holm's correction over the options.
    """
    ours, theirs = (
        {one.options: one.cells for one in side if one.contrast.name == LANGUAGE_USE}
        for side in (first, second)
    )
    found: dict[InstructionOptions, Gap] = {}
    for options in (options for options in ours if options in theirs):
        here, there = ours[options], theirs[options]
        pairs = [Pairs.of(here[one][0], there[one][0]) for one in here if one in there]
        if (gap := measure_gap(pairs, rng)) is not None:
            found[options] = gap
    adjusted = holm([gap.p_value for gap in found.values()])
    return dict(zip(found, zip(found.values(), adjusted, strict=True), strict=True))


def _figure(
    policy_run: PolicyRun,
    options: InstructionOptions,
    contrast: ArmContrast,
    tasks: Mapping[str, Mapping[Trial, Arms]],
    rng: np.random.Generator,
) -> ArmFigure | None:
    cells: dict[str, SideCells] = {}
    for task, trials in tasks.items():
        sides = [one for trial in sorted(trials) if (one := contrast.sides(trial, trials[trial]))]
        if sides:
            first, second = (
                CellResults({trial: won for one in side for trial, won in one.items()})
                for side in zip(*sides, strict=True)
            )
            cells[task] = first, second
    gap = measure_gap([Pairs.of(*pair) for pair in cells.values()], rng)
    if gap is None:
        return None
    intervals = (
        clustered_interval([first for first, _ in cells.values()], rng),
        clustered_interval([second for _, second in cells.values()], rng),
    )
    return ArmFigure(policy_run, options, contrast, cells, intervals, gap, gap.p_value)


def _corrected(found: Sequence[ArmFigure]) -> Iterable[ArmFigure]:
    adjusted = holm([one.gap.p_value for one in found])
    return [replace(one, p_holm=p_value) for one, p_value in zip(found, adjusted, strict=True)]


def _won(one: Summary) -> bool:
    return one.outcome == "success"


def _against(*others: str) -> Callable[[Trial, Arms], Sides | None]:
    def sides(trial: Trial, arms: Arms) -> Sides | None:
        other = next((arms[name] for name in others if name in arms), None)
        if other is None or TOLD not in arms:
            return None
        return {trial: _won(arms[TOLD])}, {trial: _won(other)}

    return sides


def _language_use(trial: Trial, arms: Arms) -> Sides | None:
    told, other = arms.get(TOLD), arms.get(OTHER_GOAL)
    if told is None or other is None or told.goals is None or other.goals is None:
        return None
    own_twice = _won(told) and other.goals.original == "success"
    # The world ends with the told verdict, so there the other goal can only be begun.
    other_twice = _won(other) and other.goals.stated in told.goals.agrees
    return {trial: _won(told) and _won(other)}, {trial: own_twice or other_twice}


def _paraphrases(trial: Trial, arms: Arms) -> Sides | None:
    wins = [_won(one) for arm, one in sorted(arms.items()) if paraphrase_number(arm)]
    if len(wins) < 2:  # noqa: PLR2004
        return None
    # Paraphrases stand as seeds of their own, none of which the two sides share.
    every = {Trial(trial.episode, -1 - trial.policy_seed): all(wins)}
    first = trial.policy_seed * MOST_PARAPHRASES
    return every, {Trial(trial.episode, first + place): won for place, won in enumerate(wins)}


CONTRASTS = (
    ArmContrast(LANGUAGE_USE, "both followed", "same done", _language_use),
    ArmContrast(WORDS_WORTH, TOLD, SILENT, _against(SILENT, SILENT_EMPTY)),
    ArmContrast("order's worth", TOLD, SCRAMBLED, _against(SCRAMBLED)),
    ArmContrast("paraphrases", "all", "mean", _paraphrases),
    ArmContrast("repeat", TOLD, AGAIN, _against(AGAIN)),
)
MEANING = (
    "Language use: first the scenes in which the told goal and another one were both reached when "
    "stated; second those in which the same goal was pursued whichever was stated. Words' worth "
    "and order's worth: success when told, against silence and against scrambled words. "
    "Paraphrases: all of them succeed, against their mean. Repeat: another policy seed."
)
"""The two rates of each contrast."""
