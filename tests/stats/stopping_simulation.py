"""Simulate runs that stop when they are decided, and print the table of the page about them.

python tests/stats/stopping_simulation.py
python tests/stats/stopping_simulation.py --runs 500
python tests/stats/stopping_simulation.py --packs results/scripted.roboirg.zip

In every case two policies play the same scenes; a look follows each scene. Printed are how often a
difference is found where there is none, how often the interval misses at some look, and how many
scenes it takes. The whole takes some minutes of processor time.

With `--packs` the results are those of stored runs: every gap of a policy to explicit and every
pair of policies is decided alone, with its scenes in 100 random orders.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.analysis.measures.comparison import compare, compare_settings
from roboirg.analysis.results.reading import read_frame
from roboirg.analysis.results.sources import opened_sources
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import options_label
from roboirg.stats.anytime import PairedScenes, decide, p_path, winnings_above
from roboirg.stats.intervals import ALPHA
from roboirg.stats.paired_tests import sign_flip_test

Numbers = NDArray[np.float64]

RUNS = 10_000
MARGIN = 0.1
AT_ONCE = 250
"""Runs in memory at a time."""
ORDERS = 100
"""Of the scenes of stored runs."""
EVEN = (50,) * 11
UNEVEN = (3, 5, 10, 20, 20, 50, 50, 50, 100, 100, 142)
"""Scenes of each task, 550 in all."""


class Case(NamedTuple):
    """Two policies, by the chances of a scene.

    Attributes:
        name: in the table.
        only_first: chance that the first succeeds alone; of each task, or of all.
        only_second: that the second does.
        sizes: scenes of each task.
    """

    name: str
    only_first: tuple[float, ...]
    only_second: tuple[float, ...]
    sizes: tuple[int, ...] = EVEN


def _alike(rate: float) -> tuple[float, ...]:
    """Return the chance that one of two independent policies of a rate succeeds alone."""
    return (rate * (1 - rate),)


SAME = (
    Case("2 %", _alike(0.02), _alike(0.02)),
    Case("10 %", _alike(0.1), _alike(0.1)),
    Case("50 %", _alike(0.5), _alike(0.5)),
    Case("90 %", _alike(0.9), _alike(0.9)),
    Case("98 %", _alike(0.98), _alike(0.98)),
    Case("almost all ties", (0.005,), (0.005,)),
    Case("uneven tasks", _alike(0.5), _alike(0.5), UNEVEN),
    Case("tasks that are opposed", (0.4, 0.1) * 5 + (0.25,), (0.1, 0.4) * 5 + (0.25,)),
)
"""Cases without a difference."""
DIFFERENT = (
    Case("3 points", (0.115,), (0.085,)),
    Case("5 points", (0.125,), (0.075,)),
    Case("10 points", (0.15,), (0.05,)),
    Case("15 points", (0.175,), (0.025,)),
    Case("20 points, 40 % discordant", (0.3,), (0.1,)),
    Case("30 points, uneven tasks", (0.35,), (0.05,), UNEVEN),
)
"""Cases with one; the two succeed alone in 20 % of scenes where nothing else is said."""


class Found(NamedTuple):
    """What happened in the runs of a case, as shares of all runs.

    Attributes:
        first: found to be better.
        second: found to be better.
        within: closed because the difference is surely below the margin.
        missed: in which the interval missed the difference of the plan at some look.
        played: median share of scenes that were played.
        fixed: in which the fixed test on all scenes finds a difference.
        unpaired: in which the same bets find one if results are not paired.
        unpaired_played: median share of scenes then.
    """

    first: float
    second: float
    within: float
    missed: float
    played: float
    fixed: float
    unpaired: float
    unpaired_played: float


def simulate(case: Case, runs: int, rng: np.random.Generator) -> Found:
    """Play a case many times.

    Args:
        case: to play.
        runs: how often.
        rng: draws results and the order of scenes.
    """
    parts = []
    for begin in range(0, runs, AT_ONCE):
        parts.append(_play(case, min(AT_ONCE, runs - begin), rng))
    columns = np.concatenate(parts, axis=1)
    means = Found._make(columns.mean(axis=1).tolist())
    medians = Found._make(np.median(columns, axis=1).tolist())
    return means._replace(played=medians.played, unpaired_played=medians.unpaired_played)


def _play(case: Case, runs: int, rng: np.random.Generator) -> Numbers:
    """Return a row for each field of `Found`, with a column for each run."""
    scenes = sum(case.sizes)
    only_first = np.repeat(np.broadcast_to(case.only_first, len(case.sizes)), case.sizes)
    only_second = np.repeat(np.broadcast_to(case.only_second, len(case.sizes)), case.sizes)
    luck = rng.random((runs, scenes))
    first_alone = luck < only_first
    second_alone = (luck >= only_first) & (luck < only_first + only_second)
    both = (luck >= only_first + only_second) & (rng.integers(2, size=(runs, scenes)) == 1)
    sizes = np.repeat(np.array(case.sizes), case.sizes)
    weights = scenes / (len(case.sizes) * sizes)  # the mean over tasks counts
    order = np.argsort(rng.random((runs, scenes)), axis=1)
    first = np.take_along_axis((first_alone | both).astype(np.float64), order, axis=1)
    second = np.take_along_axis((second_alone | both).astype(np.float64), order, axis=1)
    differences = first - second
    weighted = Weighted.of(differences, weights[order])

    found = _first_place(p_path(differences) <= ALPHA)
    within = _first_place(_is_within(weighted))
    is_found = (found < scenes) & (found <= within)
    is_within = (within < scenes) & ~is_found
    sums = np.cumsum(differences, axis=1)
    is_positive = sums[np.arange(runs), np.minimum(found, scenes - 1)] > 0
    unpaired = first - rng.permuted(second, axis=1)
    unpaired_found = _first_place(p_path(unpaired) <= ALPHA)
    fixed = [sign_flip_test(row.astype(np.int64)) <= ALPHA for row in differences]
    return np.array(
        [
            is_found & is_positive,
            is_found & ~is_positive,
            is_within,
            _has_missed(weighted),
            np.minimum(np.minimum(found, within) + 1, scenes) / scenes,
            fixed,
            unpaired_found < scenes,
            np.minimum(unpaired_found + 1, scenes) / scenes,
        ],
        dtype=np.float64,
    )


def _first_place(holds: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return of each row the first place where it is true; its length if it is nowhere."""
    places = np.argmax(holds, axis=1)
    return np.where(holds.any(axis=1), places, holds.shape[1])


class Weighted(NamedTuple):
    """Weighted differences of scenes as numbers from 0 to 1.

    Attributes:
        shares: (runs, scenes), 0.5 for no difference.
        scale: a mean share of m is a mean difference of scale · (2 m - 1).
    """

    shares: Numbers
    scale: float

    @classmethod
    def of(cls, differences: Numbers, weights: Numbers) -> Weighted:
        """Return differences (runs, scenes), -1 to 1, with the weights of their scenes."""
        scale = float(weights.max())
        return cls((1 + differences * weights / scale) / 2, scale)


def _is_within(weighted: Weighted) -> NDArray[np.bool_]:
    """Return after each scene whether the difference is surely below the margin."""
    shares = weighted.shares
    lowest = (1 - MARGIN / weighted.scale) / 2
    scenes = shares.shape[1]
    is_below = winnings_above(lowest, 1 - shares, scenes) >= 2 / ALPHA
    is_above = winnings_above(lowest, shares, scenes) >= 2 / ALPHA
    is_below = np.logical_or.accumulate(is_below, axis=1)
    is_above = np.logical_or.accumulate(is_above, axis=1)
    return np.asarray(is_below & is_above)


def _has_missed(weighted: Weighted) -> NDArray[np.bool_]:
    """Return of each run whether its interval misses the mean of all scenes at some look."""
    shares = weighted.shares
    mean = shares.mean(axis=1, keepdims=True)
    scenes = shares.shape[1]
    is_above = winnings_above(mean, shares, scenes).max(axis=1) >= 2 / ALPHA
    is_below = winnings_above(1 - mean, 1 - shares, scenes).max(axis=1) >= 2 / ALPHA
    return np.asarray(is_above | is_below)


def show_runs(paths: Sequence[str], rng: np.random.Generator) -> None:
    """Print when comparisons of stored runs are decided, and for which side, in random orders."""
    with opened_sources(paths) as sources:
        frame = read_frame(sources)
    _show("| comparison | found, % | wrong side, % | undecided, % | played, % |")
    _show("| --- | ---: | ---: | ---: | ---: |")
    rows = []
    for first, second in itertools.combinations_with_replacement(frame.names, 2):
        with contextlib.suppress(InvalidValueError):  # they have no scene in common
            if first == second:
                comparison = compare_settings(frame.where(run=first))
                compared = f"gap of {first.policy}"
            else:
                comparison = compare(frame.where(run=first), frame.where(run=second))
                compared = f"{first.policy} to {second.policy}"
            for average, figures in zip(comparison.averages, comparison.anytime, strict=True):
                row = _in_random_orders(figures.pairs, rng)
                _show_row(f"{options_label(average.key.options)}, {compared}", row)
                rows.append(row)
    _show_row(f"mean of {len(rows)}", np.mean(rows, axis=0).tolist())


def _in_random_orders(pairs: PairedScenes, rng: np.random.Generator) -> list[float]:
    """Return shares of orders: found, for the wrong side, undecided; and the median of scenes."""
    findings: Counter[str] = Counter()
    played = []
    for _ in range(ORDERS):
        order = rng.permutation(pairs.known)
        shuffled = PairedScenes(pairs.differences[order], pairs.weights[order])
        (decision,) = decide([shuffled], ALPHA, MARGIN)
        findings[decision.finding] += 1
        played.append(decision.places / pairs.known)
    worse = "second" if pairs.better == "first" else "first"
    found = findings["first"] + findings["second"]
    counts = np.array([found, findings[worse], findings["undecided"]])
    return [*(counts / ORDERS), np.median(played)]


def main() -> None:
    """Print the two tables of the page, or the one of stored runs, in Markdown."""
    parser = argparse.ArgumentParser(description="Simulate runs that stop when they are decided.")
    parser.add_argument("--runs", type=int, default=RUNS)
    parser.add_argument("--seed", type=int, default=94)
    parser.add_argument("--packs", nargs="+", metavar="RUN", help="complete runs")
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    if options.packs:
        show_runs(options.packs, rng)
        return
    _show("| no difference | found, % | interval missed, % | within 10 points, % | played, % |")
    _show("| --- | ---: | ---: | ---: | ---: |")
    for case in SAME:
        found = simulate(case, options.runs, rng)
        either = found.first + found.second
        numbers = [either, found.missed, found.within, found.played]
        _show_row(case.name, numbers)
    _show("")
    _show(
        "| difference | found, % | wrong side, % | within 10 points, % | played, % | fixed test, % "
        "| not paired: found, % | played, % |"
    )
    _show("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for case in DIFFERENT:
        found = simulate(case, options.runs, rng)
        numbers = [found.first, found.second, found.within, found.played]
        numbers += [found.fixed, found.unpaired, found.unpaired_played]
        _show_row(case.name, numbers)


def _show(line: str) -> None:
    print(line, flush=True)  # noqa: T201 - it is a script


def _show_row(name: str, shares: Sequence[float]) -> None:
    _show(" | ".join([f"| {name}", *(f"{100 * share:.1f}" for share in shares)]) + " |")


if __name__ == "__main__":
    main()
