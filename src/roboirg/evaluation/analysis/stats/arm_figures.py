"""What control arms show: each figure compares two rates over the same scenes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import msgspec
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
from roboirg.evaluation.analysis.results.frame import Frame
from roboirg.evaluation.analysis.results.option_labels import options_sort_key
from roboirg.evaluation.analysis.results.policy_run import PolicyRun
from roboirg.evaluation.analysis.stats.cells import Cell, Key, Trial, clustered_interval
from roboirg.evaluation.analysis.stats.intervals import SEED
from roboirg.evaluation.analysis.stats.measure import Measured, pair, with_holm
from roboirg.evaluation.analysis.stats.paired_tests import measure_gap
from roboirg.evaluation.records.record import Summary

LANGUAGE_USE, WORDS_WORTH, ORDERS_WORTH = "language use", "words' worth", "order's worth"

Arms = Mapping[str, Summary]
"""The results of one trial by arm."""
Sides = tuple[Sequence[Summary], Sequence[Summary]]
"""What counts in the first and in the second rate, as results whose outcome is that."""


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
    sides: Callable[[Arms], Sides | None]


class ArmKey(NamedTuple):
    """Policy run as of the arm ``told``, options of the instruction, and which figure."""

    run: PolicyRun
    options: InstructionOptions
    contrast: ArmContrast


ArmFigure = Measured[ArmKey]
"""The results of the first rate, its gap to the second, and its p-value, corrected over all figures
of the policy run."""


def arm_figures(frame: Frame) -> tuple[ArmFigure, ...]:
    """Return the figures for which the arms were played, by policy run and setting."""
    rng = np.random.default_rng(SEED)
    found: dict[tuple[PolicyRun, InstructionOptions], dict[Key, dict[str, Summary]]] = {}
    for run, options, one in zip(frame["run"], frame["options"], frame["result"], strict=True):
        if isinstance(one, Summary) and one.outcome != "error":
            told = run._replace(conditions=run.conditions._replace(arm=TOLD))
            trials = found.setdefault((told, options), {})
            trials.setdefault((one.task, one.episode, one.policy_seed), {})[one.arm] = one
    runs = list(dict.fromkeys(run for run, _ in found))
    figures = [
        figure
        for run, options in sorted(found, key=lambda key: options_sort_key(key[1]))
        for contrast in CONTRASTS
        if (figure := _figure(ArmKey(run, options, contrast), found[run, options].values(), rng))
    ]
    figures.sort(key=lambda one: runs.index(one.key.run))
    return with_holm(figures, lambda key: key.run)


def _figure(key: ArmKey, trials: Iterable[Arms], rng: np.random.Generator) -> ArmFigure | None:
    cells: list[dict[str, Cell]] = [{}, {}]
    for arms in trials:
        for side, results in zip(cells, key.contrast.sides(arms) or (), strict=False):
            for one in results:
                # Paraphrases stand as policy seeds of their own.
                seed = one.policy_seed * (MOST_PARAPHRASES + 1) + (paraphrase_number(one.arm) or 0)
                side.setdefault(one.task, Cell()).add(Trial(one.episode, seed), one.outcome)
    first, second = cells
    gap = measure_gap(pair(first, second), rng)
    if gap is None:
        return None
    interval, other = (clustered_interval([*side.values()], rng) for side in cells)
    return Measured(key, first, second, interval, gap, other_interval=other)


def _won(one: Summary) -> bool:
    return one.outcome == "success"


def _with_outcome(one: Summary, *, is_success: bool) -> Summary:
    return msgspec.structs.replace(one, outcome="success" if is_success else "failure")


def _against(other: str) -> Callable[[Arms], Sides | None]:
    def sides(arms: Arms) -> Sides | None:
        return ([arms[TOLD]], [arms[other]]) if TOLD in arms and other in arms else None

    return sides


def _language_use(arms: Arms) -> Sides | None:
    told = arms.get(TOLD)
    other = arms.get(OTHER_GOAL)
    if told is None or other is None or told.goals is None or other.goals is None:
        return None
    own_twice = _won(told) and other.goals.original == "success"
    # The world ends with the told verdict, so there the other goal can only be begun.
    other_twice = _won(other) and other.goals.stated in told.goals.agrees
    return (
        [_with_outcome(told, is_success=_won(told) and _won(other))],
        [_with_outcome(told, is_success=own_twice or other_twice)],
    )


def _paraphrases(arms: Arms) -> Sides | None:
    found = [one for arm, one in sorted(arms.items()) if paraphrase_number(arm)]
    if len(found) < 2:  # noqa: PLR2004
        return None
    every = all(map(_won, found))
    return [_with_outcome(one, is_success=every) for one in found], found


CONTRASTS = (
    ArmContrast(LANGUAGE_USE, "each reached when stated", "same pursued", _language_use),
    ArmContrast(WORDS_WORTH, TOLD, SILENT, _against(SILENT)),
    ArmContrast(WORDS_WORTH, TOLD, SILENT_EMPTY, _against(SILENT_EMPTY)),
    ArmContrast(ORDERS_WORTH, TOLD, SCRAMBLED, _against(SCRAMBLED)),
    ArmContrast("paraphrases", "all", "mean", _paraphrases),
    ArmContrast("repeat", TOLD, AGAIN, _against(AGAIN)),
)
MEANING = (
    "Language use: first, the share of scenes in which each of two goals was reached when stated; "
    "second, that in which the same goal was reached in both rollouts, whichever was stated; told "
    "ends at its verdict, so there the other goal counts if the first wrong act agrees with it. "
    "Words' worth: success when told, then in silence. Order's worth: success when told, then with "
    "scrambled words. Paraphrases: success in all of them, then their mean. Repeat: success when "
    "told, then with another policy seed."
)
"""The two rates of each contrast."""
