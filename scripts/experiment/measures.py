"""From a frame of trials to the numbers on pages: rates and differences, with their intervals."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pandas as pd

from roboirg.analysis.measures.measure import ALL_TASKS
from roboirg.core.errors import RoboIRGError
from roboirg.core.failures import FAILURE_KINDS
from roboirg.core.policy_ref import RESOLVE
from roboirg.language.settings import EXPLICIT
from roboirg.stats.intervals import TaskRates, mean_rates, share_interval
from roboirg_learn.listener.study_report import trained_rate

IMPLICIT = ("direct", "reasoning", "contextual", "spatial")
MEAN = "implicit"
"""In the place of a setting: the mean over those of `IMPLICIT` that a task has."""
SUCCESS = "success"
SHARE = "share of the gap"
"""How much of the gap to explicit words a rewriter closes, for the reader of explicit words that
stands behind it."""
OVER = " over "
"""Stands before the reference of a difference: ``success over true goal``."""
REFERENCES = {
    "explicit words": ("setting", EXPLICIT),
    "true goal": ("reader", "truth"),
    "no memory": ("memory", "none"),
    "explicit reader": ("reader", "explicit"),
}
"""What rates are compared with, all else being equal: a column and its value there."""
ABOUT = ["memory", "reader", "setting", "number"]
"""Columns that tell what a number is about, but for its scope."""
EPISODE = ["suite", "task", "policy_seed", "episode"]


class Measure(NamedTuple):
    """A rate, or its difference to a reference on the same episodes and trainings.

    Attributes:
        scope: a suite, or all tasks, over which it is a mean.
        memory: of the body, or what needs none.
        reader: what tells it the goal.
        setting: of the words, with what is chosen (``direct (resolved)``), or `MEAN`.
        number: ``success``, a kind of failure, one of these over one of `REFERENCES`, or `SHARE`.
        value: from -1 to 1.
        low: of the 95 % interval over scenes and trainings, for `SHARE` over scenes; not a number
            if there is none.
        high: of the interval.
        by_seed: the value of each training, with blanks between them.
    """

    scope: str
    memory: str
    reader: str
    setting: str
    number: str
    value: float
    low: float = math.nan
    high: float = math.nan
    by_seed: str = ""


def measure_frame(frame: pd.DataFrame) -> list[Measure]:
    """Return all measures of the trials of a frame; a resolved form is a setting of its own.

    A trial that stands there several times, as parts of the study may share it, counts once.

    Raises:
        RoboIRGError: a policy lacks trials that another one has in the same setting.
    """
    trials = frame.assign(setting=frame["instruction_options"]).sort_values(EPISODE)
    trials = trials.drop_duplicates(["policy", "setting", *EPISODE, "outcome"])
    played = trials.groupby(["setting", "policy", "policy_seed"]).size()
    if (played.groupby("setting").nunique() > 1).any():
        raise RoboIRGError(f"Trials are missing; hear and play them:\n{played.to_string()}")
    trials[["memory", "reader"]] = trials["policy"].str.split("-", n=1, expand=True)
    has_succeeded = trials["outcome"] == "success"
    ends = trials["failure_kind"].astype(object).fillna("undecided").mask(has_succeeded, SUCCESS)
    measures = []
    for end in (SUCCESS, *FAILURE_KINDS):
        counted = trials.assign(number=end, value=(ends == end).astype(float))
        compared = _compared(counted[[*ABOUT, *EPISODE, "value"]])
        for about, same in compared.groupby(ABOUT, sort=False):
            measures.append(_measured(ALL_TASKS, about, same))
            for suite, some in same.groupby("suite", sort=False):
                measures.append(_measured(suite, about, some))
        if end == SUCCESS:
            measures += _shares(compared[compared["number"] == SUCCESS])
    return measures


def _compared(trials: pd.DataFrame) -> pd.DataFrame:
    """Return trials, their means over settings, and the differences of both to the references.

    A difference is moved from between -1 and 1 to between 0 and 1, as rates are.

    Args:
        trials: `value` is 1 or 0 by how they ended, `number` says what is counted.
    """
    implicit = trials[trials["setting"].isin(IMPLICIT)].assign(setting=MEAN)
    means = implicit.groupby([*ABOUT, *EPISODE], as_index=False, sort=False).mean()
    alone = pd.concat([trials, means])
    compared = [alone]
    for name, (column, value) in REFERENCES.items():
        is_reference = alone[column] == value
        shared = [key for key in (*ABOUT, *EPISODE) if key != column]
        others = alone[is_reference].set_index(shared)["value"].rename("other")
        pairs = alone[~is_reference].join(others, on=shared, how="inner")
        moved = (1 + pairs["value"] - pairs["other"]) / 2
        compared.append(pairs.assign(number=pairs["number"] + OVER + name, value=moved))
    return pd.concat(compared)


def _measured(scope: str, about: tuple[str, str, str, str], trials: pd.DataFrame) -> Measure:
    """Return what trials that are about the same give, sorted by task, seed and episode."""
    tasks = []
    for _, rows in trials.groupby("task", sort=False):
        tasks.append(rows["value"].to_numpy().reshape(rows["policy_seed"].nunique(), -1))
    found = trained_rate(tasks)
    numbers = [found.rate, *(found.interval or (math.nan, math.nan)), *found.by_seed]
    if OVER in about[-1]:
        numbers = [2 * number - 1 for number in numbers]
    value, low, high, *by_seed = [round(number, 6) for number in numbers]
    return Measure(scope, *about, value, low, high, " ".join(map(str, by_seed)))


def _shares(trials: pd.DataFrame) -> Iterator[Measure]:
    """Yield the shares of gaps that rewriters close in all tasks, where the gap is clear.

    Args:
        trials: `value` is 1 if one succeeded, else 0; with their means over settings as `MEAN`.
    """
    scene = ["memory", "task", "policy_seed", "episode"]
    values = trials.pivot(index=scene, columns=["reader", "setting"], values="value")
    for reader, setting in values:
        if not reader.startswith(RESOLVE):
            continue
        columns = [(reader, setting), ("explicit", setting), ("explicit", EXPLICIT)]
        for memory, same in values[columns].dropna().groupby("memory"):
            tasks = []
            # Trainings of an episode are no episodes of their own, so their mean counts.
            for _, rates in same.groupby(["task", "episode"]).mean().groupby("task"):
                weights = np.full(len(rates), 1 / len(rates))
                tasks.append(TaskRates(rates.to_numpy(), weights, np.full(3, True)))
            interval = share_interval(tasks)
            if interval is not None:
                rewritten, said, explicit = mean_rates(tasks)
                share = (rewritten - said) / (explicit - said)
                yield Measure(ALL_TASKS, memory, reader, setting, SHARE, share, *interval)
