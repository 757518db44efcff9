"""How often intervals hold the true value, by simulation: the table of docs/statistics.md.

``python tests/stats/interval_coverage.py`` prints it: for each number of tasks, episodes and policy
seeds the lowest coverage over rates from 1 to 99 % and over correlations of the trials of an
episode. Three rates are drawn on the same episodes: of two sides, such as a setting and explicit,
and one between them, such as another setting or the setting behind a rewriter.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.stats.intervals import Interval, Rows, TaskRates, mean_interval, share_interval

KINDS = ("rate", "gap", "retention", "headline", "share")
RATES = (
    (0.01, 0.01), (0.02, 0.04), (0.05, 0.2), (0.3, 0.6), (0.5, 0.5), (0.8, 0.95), (0.98, 0.99),
    (0.02, 0.9),
)  # fmt: skip
"""True rates of the two sides; those of several tasks lie around these."""
CORRELATIONS = (0.0, 0.5, 0.9)
"""Of the normal variables behind all trials of an episode, of both sides."""
SPREAD = 1.0
"""How far the log-odds of the easiest and the hardest of several tasks are from the middle."""

SCREENING = 200
SIMULATIONS = 1500
"""Of each case, and again of the worst one."""


class Design(NamedTuple):
    """What is played: for each task the number of episodes, and the number of policy seeds."""

    name: str
    episodes: Sequence[int]
    seeds: int


DESIGNS = (
    Design("1 task of 20", [20], 1),
    Design("1 task of 50", [50], 1),
    Design("1 task of 150", [150], 1),
    Design("1 task of 50", [50], 3),
    Design("4 tasks of 20", [20] * 4, 1),
    Design("4 tasks of 50", [50] * 4, 3),
    Design("4 tasks of 5, 20, 50 and 100", [5, 20, 50, 100], 1),
    Design("11 tasks of 20", [20] * 11, 1),
    Design("11 tasks: one of 3, ten of 50", [3] + [50] * 10, 3),
)


class Truth(NamedTuple):
    """The true rates of the two sides, and of what lies between them."""

    first: float
    second: float
    between: float


def task_rates(rate: float, tasks: int) -> NDArray[np.float64]:
    """Return the true rates of some tasks around one, evenly spaced in log-odds."""
    spread = SPREAD if tasks > 1 else 0.0
    odds = rate / (1 - rate) * np.exp(np.linspace(-spread, spread, tasks))
    return np.asarray(odds / (1 + odds))


def drawn_rows(
    rng: np.random.Generator, episodes: int, seeds: int, rates: Sequence[float], correlation: float
) -> Rows:
    """Return successes and trials of all sides by episode, as of `TaskRates`."""
    sides = len(rates)
    shared = rng.standard_normal((episodes, 1, 1))
    alone = rng.standard_normal((episodes, sides, seeds))
    ease = np.sqrt(correlation) * shared + np.sqrt(1 - correlation) * alone
    limits = [NormalDist().inv_cdf(rate) for rate in rates]
    wins = (ease < np.reshape(limits, (sides, 1))).sum(axis=2)
    rows = np.full((episodes, 2 * sides), seeds)
    rows[:, 0::2] = wins
    return rows


def missed(
    design: Design, rates: tuple[float, float], correlation: float, rng: np.random.Generator
) -> Iterator[str]:
    """Simulate a run once; yield the kinds of intervals that are printed and miss the truth.

    That of the retention holds it if that of a difference holds 0: of the first rate times the true
    second one, less the second rate times the true first one.
    """
    count = len(design.episodes)
    first = task_rates(rates[0], count)
    second = task_rates(rates[1], count)
    between = (first + second) / 2
    tasks = []
    for episodes, *rates_of_task in zip(design.episodes, first, second, between, strict=True):
        tasks.append(
            TaskRates.of(drawn_rows(rng, episodes, design.seeds, rates_of_task, correlation))
        )
    truth = Truth(first.mean(), second.mean(), between.mean())
    factors = {
        "rate": (1, 0, 0),
        "gap": (1, -1, 0),
        "retention": (truth.second, -truth.first, 0),
        "headline": (0.5, -1, 0.5),
    }
    truths = {
        "rate": truth.first,
        "gap": truth.first - truth.second,
        "retention": 0.0,
        "headline": (truth.first + truth.between) / 2 - truth.second,
    }
    for kind, factors_of_kind in factors.items():
        strata = [task.combined(*np.divide(factors_of_kind, count)) for task in tasks]
        if not holds(mean_interval(strata), truths[kind]):
            yield kind
    # What lies between closes half of the gap; without a gap that is seen, no share is printed.
    share = share_interval([_in_order_of_share(task) for task in tasks])
    if share is not None and rates[0] < rates[1] and not holds(share, 0.5):
        yield "share"


def _in_order_of_share(task: TaskRates) -> TaskRates:
    """Return rates in the order of `share_interval`: between, first, second."""
    order = [2, 0, 1]
    return TaskRates(task.contributions[:, order], task.weights, task.has_trials[order])


def holds(interval: Interval | None, truth: float) -> bool:
    """Return whether an interval holds the true value, but for rounding."""
    return interval is not None and interval.low - 1e-6 <= truth <= interval.high + 1e-6


def coverage(
    design: Design,
    rates: tuple[float, float],
    correlation: float,
    simulations: int,
    seed: int = 7,
) -> dict[str, float]:
    """Return the share of simulated runs, by kind of interval, that print none that misses."""
    rng = np.random.default_rng(seed)
    counts = dict.fromkeys(KINDS, 0)
    for _ in range(simulations):
        for kind in missed(design, rates, correlation, rng):
            counts[kind] += 1
    return {kind: 1 - count / simulations for kind, count in counts.items()}


def lowest_coverage(design: Design) -> list[float]:
    """Return for each kind of interval the coverage in its worst case of rates and correlation.

    Of `SCREENING` simulations of each case some is the lowest by chance. So the case in which it is
    the lowest is simulated again, with other draws.
    """
    cases = list(itertools.product(RATES, CORRELATIONS))
    screened = [coverage(design, *case, SCREENING) for case in cases]
    shares = []
    for kind in KINDS:
        worst = min(range(len(cases)), key=lambda number: screened[number][kind])
        shares.append(coverage(design, *cases[worst], SIMULATIONS, seed=8)[kind])
    return shares


def main() -> None:
    """Print a line of the table for each design, in percent."""
    for design in DESIGNS:
        texts = [f"{100 * share:.1f}" for share in lowest_coverage(design)]
        line = f"| {design.name} | {design.seeds} | {' | '.join(texts)} |"
        print(line, flush=True)  # noqa: T201 - it is a script


if __name__ == "__main__":
    main()
