"""Rates of groups of trials, and their gaps to others on the same episodes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from roboirg.core.errors import InvalidValueError, UnknownNameError, check_names
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.results.frame import suite
from roboirg.evaluation.analysis.results.option_labels import reference_of
from roboirg.evaluation.analysis.results.policy_run import PolicyRun
from roboirg.evaluation.analysis.stats.cells import (
    NOTHING,
    TRIAL,
    ByTask,
    Cell,
    Cells,
    Columns,
    Counts,
    cell_interval,
    clustered_interval,
    gather,
)
from roboirg.evaluation.analysis.stats.intervals import SEED, Interval
from roboirg.evaluation.analysis.stats.paired_tests import Gap, Pairs, holm, measure_gap

ALL_TASKS = "all tasks"
KEPT_APART = (
    *("policy", "form", "arm", "delivery", "split", "wordings", "max_steps", "meshes"),
    *("observe_every", "demonstration_frames", "language_version", "environment_version"),
    *("policy_version", "robot", "policy_label", "instruction_options"),
)
"""Columns over whose values a rate is taken only if the call names them."""

K = TypeVar("K", bound=tuple[Any, ...])


@dataclass(frozen=True, slots=True)
class Measured(Generic[K]):
    """What was measured of a group.

    Attributes:
        key: values of the columns that it is grouped by.
        cells: its trials by task.
        others: those of the first reference.
        interval: 95 %, of the rate; None if it was not measured, or with too few episodes.
        gap: to the first reference on the same episodes; None without pairs.
        second_gap: to the second reference, if there is one.
        other_interval: 95 %, of the rate of the first reference; None if it was not measured.
        p_holm: p-value of the gap after Holm's correction over its family.
    """

    key: K
    cells: ByTask
    others: ByTask = field(default_factory=dict)
    interval: Interval | None = None
    gap: Gap | None = None
    second_gap: Gap | None = None
    other_interval: Interval | None = None
    p_holm: float | None = None

    @property
    def tasks(self) -> tuple[str, ...]:
        """Tasks with a verdict."""
        return tuple(task for task, cell in self.cells.items() if cell.verdicts)

    @property
    def counts(self) -> Counts:
        """The sums over tasks."""
        return Counts(*map(sum, zip(*(one.counts for one in self.cells.values()), strict=True)))

    @property
    def rate(self) -> Fraction | None:
        """Unweighted mean of the tasks' success rates; None without a verdict."""
        return mean_rate(self.cells)


def mean_rate(cells: ByTask) -> Fraction | None:
    """Return the unweighted mean of the tasks' success rates; None without a verdict."""
    rates = [cell.rate for cell in cells.values() if cell.rate is not None]
    return sum(rates, Fraction(0)) / len(rates) if rates else None


def measure(
    frame: Columns,
    by: Sequence[str],
    against: Mapping[str, object] | None = None,
    family: Sequence[str] = (),
    pool: Sequence[str] = (),
) -> tuple[Measured[tuple[Any, ...]], ...]:
    """Measure success in each group of episodes, as the mean over tasks.

    Args:
        frame: as `roboirg.results` returns it, with columns of your own if you like.
        by: columns whose values make a group.
        against: values of some of these columns that make the group to compare with, such as
            ``{"setting": "explicit"}``; the gap is on the same episodes and policy seeds.
        family: columns of `by` within whose values p-values are corrected together.
        pool: columns over whose values a rate may be taken, such as ``["form"]``. In the others
            that tell policies, words and conditions apart, all rows of a group have one value.

    Returns:
        A row for each group, in the order in which they occur.

    Raises:
        UnknownNameError: the frame has no such column, or a column no such value.
        InvalidValueError: a column is not in `by` or stands twice, a row has no task, episode or
            policy seed, an outcome is none, a group has several policies, words or conditions, or
            rows of a group are about the same trial.
    """
    changed = against or {}
    _check(frame, by, changed, family, pool)
    apart = [name for name in KEPT_APART if name in frame and name not in (*by, *pool)]
    names = (*by, *apart, *pool, *TRIAL)
    rows = {name: [_known(value) for value in frame[name]] for name in names}
    for name in TRIAL:
        if None in rows[name]:
            raise InvalidValueError(f"The column {name!r} has no value in some row; fill it in.")
    _check_apart(rows, by, apart)
    # What is pooled distinguishes trials of an episode, as the policy seed does.
    rows["policy_seed"] = list(zip(*(rows[name] for name in ("policy_seed", *pool)), strict=True))
    groups = gather(rows, by)
    counts = [cell.counts for own in groups.values() for cell in own.values()]
    if sum(one.trials + one.errors + one.missing for one in counts) < len(rows["task"]):
        raise InvalidValueError(
            "Several rows of a group are about the same trial of an episode; choose some of them, "
            f"or group by a column in which they differ, next to {', '.join(by)}."
        )

    def reference(key: tuple[Any, ...]) -> ByTask:
        other = tuple(changed.get(name, one) for name, one in zip(by, key, strict=True))
        return NOTHING if other == key else groups.get(other, NOTHING)

    places = [list(by).index(name) for name in family]
    return measure_groups(groups, [reference], lambda key: tuple(key[place] for place in places))


def _known(value: object) -> object:
    """Return a value, or None for pandas's many missing ones, which are not equal to themselves."""
    is_missing = type(value).__name__ == "NAType" or value != value  # noqa: PLR0124
    return None if is_missing else value


def _check_apart(
    rows: Mapping[str, Sequence[object]], by: Sequence[str], apart: Iterable[str]
) -> None:
    """Check that in some columns all rows of a group have the same value."""
    for name in apart:
        found = set(zip(*(rows[column] for column in (*by, name)), strict=True))
        groups = {values[:-1] for values in found}
        if len(found) > len(groups):
            known = ", ".join(sorted(map(str, set(rows[name]))))
            raise InvalidValueError(
                f"A rate would be over several values of {name} ({known}): add {name!r} to by, "
                f"choose the rows of one value, or name {name!r} in pool."
            )


def _check(
    frame: Columns,
    by: Sequence[str],
    against: Mapping[str, object],
    family: Sequence[str],
    pool: Sequence[str],
) -> None:
    columns = (*by, *family, *against, *pool, *TRIAL)
    known_columns = list(map(str, frame))
    check_names("column", columns, known_columns)
    for name in known_columns:
        if known_columns.count(name) > 1:
            raise InvalidValueError(f"The frame has several columns {name!r}; keep one.")
    for name in (*family, *against):
        if name not in by:
            raise InvalidValueError(f"The column {name!r} is not in by: {', '.join(by)}.")
    for name, value in against.items():
        if value not in (known := set(frame[name])):
            raise UnknownNameError(f"row with the {name}", value, sorted(map(str, known)))


def measure_groups(
    groups: Mapping[K, ByTask],
    references: Sequence[Callable[[K], ByTask]] = (),
    family: Callable[[K], object] = lambda _key: None,
    *,
    is_mean: Callable[[K], bool] = lambda _key: False,
    with_intervals: bool = True,
) -> tuple[Measured[K], ...]:
    """Measure groups against up to two references.

    Args:
        groups: to measure.
        references: each returns the trials with which those of a group are compared.
        family: what is read together: p-values of gaps are corrected over all of the same family.
        is_mean: whether a group is a mean over tasks even if it has only one.
        with_intervals: whether rates have intervals.
    """
    rng = np.random.default_rng(SEED)
    found = []
    for key, cells in groups.items():
        # The order of these is part of the results: they draw from one generator.
        interval = _interval(cells, rng, is_mean=is_mean(key)) if with_intervals else None
        against = [one(key) for one in references]
        gaps = [measure_gap(pair(cells, one), rng) for one in against]
        others = against[0] if against else NOTHING
        first, second, *_ = (*gaps, None, None)
        found.append(Measured(key, cells, others, interval, first, second))
    return with_holm(found, family)


def with_holm(
    rows: Sequence[Measured[K]], family: Callable[[K], object]
) -> tuple[Measured[K], ...]:
    """Return rows with the p-values of their gaps corrected over all rows of the same family."""
    families: defaultdict[object, dict[int, float]] = defaultdict(dict)
    for place, row in enumerate(rows):
        if row.gap is not None:
            families[family(row.key)][place] = row.gap.p_value
    corrected = list(rows)
    for own in families.values():
        for place, p_value in zip(own, holm([*own.values()]), strict=True):
            corrected[place] = replace(rows[place], p_holm=p_value)
    return tuple(corrected)


def _interval(cells: ByTask, rng: np.random.Generator, *, is_mean: bool) -> Interval | None:
    judged = [cell for cell in cells.values() if cell.verdicts]
    if len(judged) == 1 and not is_mean:
        return cell_interval(judged[0], rng)
    return clustered_interval(judged, rng)


def pair(cells: ByTask, others: ByTask) -> list[Pairs]:
    """Pair the trials of each task."""
    return [
        Pairs.of(cell, others[task])
        for task, cell in cells.items()
        if cell.verdicts and task in others
    ]


class ScopeKey(NamedTuple):
    """Policy run, scope (a task, a suite, or `ALL_TASKS`) and instruction options."""

    policy_run: PolicyRun
    scope: str
    options: InstructionOptions


ScopeSummary = Measured[ScopeKey]
"""What was measured in a scope."""
Summaries = Mapping[ScopeKey, ScopeSummary]


def by_scope(cells: Cells) -> Mapping[ScopeKey, ByTask]:
    """Group cells by scope, in their order: tasks, then suites, then all tasks."""
    found: dict[ScopeKey, dict[str, Cell]] = {}
    for scope_of in (str, suite, lambda _task: ALL_TASKS):
        for (policy_run, task, options), cell in cells.items():
            scope = scope_of(task)
            if scope is not None:
                found.setdefault(ScopeKey(policy_run, scope, options), {})[task] = cell
    return found


def summarize(cells: Cells, wanted: Collection[str] | None = None) -> Summaries:
    """Measure each policy run and set of options in each scope, or in those that are wanted.

    The gap is to explicit, the second gap is the implicit form less the resolved one. P-values are
    corrected over a policy run's tasks, its suites, or its averages.
    """
    scopes = by_scope(cells)

    def other(key: ScopeKey, options: InstructionOptions) -> ByTask:
        return NOTHING if options == key.options else scopes.get(key._replace(options=options), {})

    found = measure_groups(
        {key: own for key, own in scopes.items() if wanted is None or key.scope in wanted},
        (
            lambda key: other(key, reference_of(key.options)),
            lambda key: other(key, replace(key.options, form="resolved")),
        ),
        # What is read together: a policy run's tasks, suites, averages.
        lambda key: (key.policy_run, key.scope in scopes[key], key.scope == ALL_TASKS),
        is_mean=lambda key: key.scope not in scopes[key],
    )
    return {one.key: one for one in found}
