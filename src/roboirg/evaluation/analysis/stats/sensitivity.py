"""Whether a verdict depends on how results are analyzed.

Each difference between two sides (a setting minus explicit, one policy minus another) is tested as
everywhere, and again under each other choice that an analyst could have made: what an error counts
as, which seeds and machines, what a unit is, how tasks weigh. A verdict that changes rests on the
choice.
"""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.stats.arm_figures import arm_figures
from roboirg.evaluation.analysis.stats.cells import task_order
from roboirg.evaluation.analysis.stats.intervals import ALPHA, SEED
from roboirg.evaluation.analysis.stats.option_labels import (
    REFERENCE,
    options_label,
    options_sort_key,
)
from roboirg.evaluation.analysis.stats.paired_tests import holm, sign_flip_test
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.records.record import Summary
from roboirg.tasks import every_task

Direction = Literal["higher", "lower", "open"]
"""Of the first side against the second; open if the corrected test does not decide."""

Unit = Literal["rollout", "episode", "task"]
Weighting = Literal["task", "suite", "difficulty"]
"""What weighs the same in a mean."""

SIGNS = 10_000
"""Random swaps of the test where there are too many units to try all."""
_MOST_ENUMERATED = 14
_NOTHING = 1e-12
"""Differences below this are rounding."""

EXPLICIT_GAPS, ARM_CONTRASTS = "differences to explicit", "contrasts of arms"

Results = Sequence[Summary]


class Contrast(NamedTuple):
    """Two sides that are compared on the same episodes, with a label."""

    label: str
    first: Results
    second: Results


class Family(NamedTuple):
    """Contrasts whose p-values are corrected together.

    Attributes:
        policy: label of the policy run.
        kind: `EXPLICIT_GAPS` or `ARM_CONTRASTS`.
        contrasts: in order; none if what they need was not played.
    """

    policy: str
    kind: str
    contrasts: tuple[Contrast, ...]


@dataclass(frozen=True)
class AnalysisChoice:
    """One way to analyze.

    Attributes:
        label: what is chosen, in a word or two.
        keep: returns what counts of a side's results.
        unit: what the test swaps.
        weights: what weighs the same.
    """

    label: str
    keep: Callable[[Results], Results] = field(default=lambda results: results)
    unit: Unit = "episode"
    weights: Weighting = "task"


@dataclass(frozen=True)
class Robustness:
    """A verdict and what becomes of it under the other choices.

    Attributes:
        label: of the contrast.
        verdict: as everywhere.
        pairs: episodes that both sides have.
        others: the verdict under each other choice, by choice.
    """

    label: str
    verdict: Direction
    pairs: int
    others: Mapping[AnalysisChoice, Direction]

    @property
    def exceptions(self) -> tuple[AnalysisChoice, ...]:
        """The choices under which the verdict is another one."""
        return tuple(one for one, verdict in self.others.items() if verdict != self.verdict)

    @property
    def sentence(self) -> str:
        """Whether the verdict holds in all analyses, in words."""
        if not self.others:
            return "no other analysis can change it"
        if not self.exceptions:
            return f"holds in all {len(self.others)} other analyses"
        listed = ", ".join(f"{one.label} ({self.others[one]})" for one in self.exceptions)
        return f"does not hold in {len(self.exceptions)} of {len(self.others)}: {listed}"


USUAL = AnalysisChoice("usual")


def try_choices(contrasts: Sequence[Contrast]) -> tuple[Robustness, ...]:
    """Test the contrasts, which are read together, under all choices that apply to them."""
    choices = [choice for one in offers_for(contrasts) if one.differs for choice in one.choices]
    usual = _directions(contrasts, USUAL)
    others = [_directions(contrasts, choice) for choice in choices]
    return tuple(
        Robustness(
            contrast.label,
            usual[index],
            sum(1 for _ in _units(contrast.first, contrast.second, "episode")),
            {choice: found[index] for choice, found in zip(choices, others, strict=True)},
        )
        for index, contrast in enumerate(contrasts)
    )


class Offer(NamedTuple):
    """Choices that can change something only if results differ in one way.

    Attributes:
        choices: what may be chosen.
        differs: whether the results do.
        reason: why the choices change nothing otherwise.
    """

    choices: Sequence[AnalysisChoice]
    differs: bool
    reason: str


def offers_for(contrasts: Sequence[Contrast]) -> tuple[Offer, ...]:
    """Return all choices other than the usual one that an analyst of these contrasts has."""
    results = [one for each in contrasts for side in (each.first, each.second) for one in side]
    tasks = task_order({one.task for one in results})
    seeds = sorted({one.policy_seed for one in results})
    processors = Counter(one.processor for one in results).most_common()
    has_errors = any(one.outcome == "error" for one in results)
    by_seed = [AnalysisChoice(f"seed {one}", keep=_only("policy_seed", one)) for one in seeds]
    without = [
        AnalysisChoice(f"without {one}", keep=_only("task", one, has=False)) for one in tasks
    ]
    usual = [AnalysisChoice("one processor", keep=_only("processor", of)) for of, _ in processors]
    return (
        Offer([_ERRORS_FAIL], has_errors, "identical here: no error among what is compared"),
        Offer([*by_seed, _BY_ROLLOUT], len(seeds) > 1, "identical here: one policy seed"),
        Offer([_BY_TASK, *without], len(tasks) > 1, "not possible: one task"),
        Offer([_EQUAL_SUITES], _reweighs(contrasts, "suite"), _SAME_WEIGHTS),
        Offer([_EQUAL_DIFFICULTIES], _reweighs(contrasts, "difficulty"), _SAME_WEIGHTS),
        Offer(usual[:1], len(processors) > 1, "identical here: one kind of processor"),
    )


def _errors_as_failures(results: Results) -> Results:
    return [
        msgspec.structs.replace(one, outcome="failure") if one.outcome == "error" else one
        for one in results
    ]


_ERRORS_FAIL = AnalysisChoice("errors as failures", keep=_errors_as_failures)
_BY_ROLLOUT = AnalysisChoice("unit rollout", unit="rollout")
_BY_TASK = AnalysisChoice("unit task", unit="task")
_EQUAL_SUITES = AnalysisChoice("equal weights of suites", weights="suite")
_EQUAL_DIFFICULTIES = AnalysisChoice("equal weights of difficulties", weights="difficulty")
_SAME_WEIGHTS = "identical here: the same weights of scenes"


def _only(name: str, value: object, *, has: bool = True) -> Callable[[Results], Results]:
    return lambda results: [one for one in results if (getattr(one, name) == value) is has]


def _reweighs(contrasts: Iterable[Contrast], weighting: Weighting) -> bool:
    pairs = ([*_units(one.first, one.second, "episode")] for one in contrasts)
    return any(not np.allclose(_weights(of, weighting), _weights(of, "task")) for of in pairs)


def _suite(task: str) -> str:
    found = every_task().get(task)
    return "" if found is None else found.suite


def _directions(contrasts: Iterable[Contrast], choice: AnalysisChoice) -> list[Direction]:
    """Return the verdicts under a choice, corrected over all contrasts that have any episode."""
    tested = [_tested(contrast, choice) for contrast in contrasts]
    corrected = iter(holm([p_value for _, p_value in filter(None, tested)]))
    return [_direction(one[0], next(corrected)) if one else "open" for one in tested]


def _direction(value: float, p_value: float) -> Direction:
    if p_value > ALPHA or value == 0:
        return "open"
    return "higher" if value > 0 else "lower"


class _Unit(NamedTuple):
    """What two sides differ by in one unit, as a difference of rates, and where it belongs."""

    task: str
    difficulty: str
    difference: Fraction


def _tested(contrast: Contrast, choice: AnalysisChoice) -> tuple[float, float] | None:
    """Return the mean difference and its p-value; None without a pair."""
    units = list(_units(choice.keep(contrast.first), choice.keep(contrast.second), choice.unit))
    if not units:
        return None
    weights = _weights(units, choice.weights)
    values = np.array([float(one.difference) for one in units]) * weights
    mean = float(values.sum())
    mean = 0.0 if abs(mean) < _NOTHING else mean
    if choice.unit == "task":
        _, of_task = np.unique([one.task for one in units], return_inverse=True)
        return mean, swap_test(np.bincount(of_task, values).astype(np.float64))
    if choice.weights != "task":
        return mean, swap_test(values)
    # As everywhere: the mean weighs tasks equally, the test sums over units.
    scale = int(np.lcm.reduce([one.difference.denominator for one in units]))
    return mean, sign_flip_test(np.array([int(one.difference * scale) for one in units]))


def _units(first: Results, second: Results, unit: Unit) -> Iterator[_Unit]:
    """Yield what the sides differ by in each rollout, or else in each episode, that both have."""
    ours, theirs = _verdicts(first), _verdicts(second)
    difficulties = {(one.task, one.episode): one.difficulty for one in (*first, *second)}
    for where in sorted(ours.keys() & theirs.keys()):
        here, there = ours[where], theirs[where]
        shared = here.keys() & there.keys()
        each: list[Collection[int]] = [shared]
        if unit == "rollout" and shared:
            each = [[seed] for seed in sorted(shared)]
        for seeds in each:
            difference = _rate(here, seeds or here) - _rate(there, seeds or there)
            yield _Unit(where[0], difficulties[where], difference)


def _verdicts(results: Results) -> dict[tuple[str, int], dict[int, list[bool]]]:
    """Return the verdicts of each episode by policy seed; each paraphrase of a text has its own."""
    found: dict[tuple[str, int], dict[int, list[bool]]]
    found = defaultdict(lambda: defaultdict(list))
    for one in results:
        if one.outcome != "error":
            found[one.task, one.episode][one.policy_seed].append(one.outcome == "success")
    return found


def _rate(verdicts: Mapping[int, Sequence[bool]], seeds: Iterable[int]) -> Fraction:
    every = [won for seed in seeds for won in verdicts[seed]]
    return Fraction(sum(every), len(every))


def _weights(units: Sequence[_Unit], weighting: Weighting) -> list[float]:
    """Return weights that sum to 1: equal for all groups, and within suites for all tasks."""
    if weighting == "difficulty":
        sizes = Counter(one.difficulty for one in units)
        return [1 / (len(sizes) * sizes[one.difficulty]) for one in units]
    sizes = Counter(one.task for one in units)
    groups = {task: _suite(task) if weighting == "suite" else "" for task in sizes}
    members = Counter(groups.values())
    return [1 / (len(members) * members[groups[one.task]] * sizes[one.task]) for one in units]


def swap_test(values: NDArray[np.float64]) -> float:
    """Return the two-sided p-value of swapping the sides in units of any size.

    Tries all swaps of few units, and `SIGNS` random ones of many.

    Args:
        values: weighted difference of each unit.
    """
    values = values[np.abs(values) > _NOTHING]
    if not len(values):
        return 1.0
    if len(values) <= _MOST_ENUMERATED:
        signs = np.array(list(itertools.product((-1.0, 1.0), repeat=len(values))))
        added = 0
    else:
        rng = np.random.default_rng(SEED)
        signs = rng.integers(0, 2, (SIGNS, len(values))).astype(np.float64) * 2 - 1
        added = 1  # the swap that was seen
    as_far = np.abs(signs @ values) >= abs(values.sum()) - 1e-9
    return float((as_far.sum() + added) / (len(signs) + added))


def families_of(data: RunData) -> Iterator[Family]:
    """Yield for each policy the differences to explicit, then the contrasts of its control arms."""
    told, figures = data.told(), arm_figures(data)
    for policy_run, name in told.names.items():
        own = [one for owner, one in told.results if owner == policy_run]
        yield Family(name, EXPLICIT_GAPS, gap_contrasts(own))
        arms = [
            Contrast(f"{one.contrast.name}, {options_label(one.options)}", *one.sides)
            for one in figures
            if one.policy_run == policy_run
        ]
        yield Family(name, ARM_CONTRASTS, tuple(arms))


def gap_contrasts(results: Results) -> tuple[Contrast, ...]:
    """Return the gaps to explicit of one policy run, one for each set of other options."""
    by_options = _by_options(results)
    explicit = by_options.pop(REFERENCE, [])
    return tuple(
        Contrast(f"{options_label(options)} minus explicit", by_options[options], explicit)
        for options in sorted(by_options, key=options_sort_key)
        if explicit
    )


def policy_contrasts(first: Results, second: Results) -> tuple[Contrast, ...]:
    """Return the comparisons of two policy runs, one for each set of options that both played."""
    ours, theirs = _by_options(first), _by_options(second)
    return tuple(
        Contrast(options_label(options), ours[options], theirs[options])
        for options in sorted(ours.keys() & theirs.keys(), key=options_sort_key)
    )


def _by_options(results: Results) -> dict[InstructionOptions, list[Summary]]:
    found: dict[InstructionOptions, list[Summary]] = defaultdict(list)
    for one in results:
        found[one.column].append(one)
    return found
