"""Rates of groups of trials, and their gaps to others on the same episodes.

A trial is one play of an episode with a policy seed; a cell holds the trials of one task. A group
has a cell for each of its tasks, and its rate is the mean of theirs. What it is compared with is
its reference: the gap pairs trials of the same episode. A scope is a task, a suite, or all tasks.
"""

from __future__ import annotations

import functools
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, Generic, NamedTuple, TypeVar

from roboirg.analysis.results.frame import suite
from roboirg.analysis.results.option_labels import REFERENCE_OPTIONS
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.analysis.results.run_cells import CellKey, Cells
from roboirg.core.errors import InvalidValueError, UnknownNameError, check_names
from roboirg.core.instruction_options import InstructionOptions
from roboirg.stats.cells import (
    NOTHING,
    TRIAL,
    ByTask,
    Cell,
    Columns,
    Counts,
    Key,
    gather,
    rate_interval,
    rows_of,
)
from roboirg.stats.intervals import Interval
from roboirg.stats.paired_tests import Gap, Pairs, holm, measure_gap

ALL_TASKS = "all tasks"
KEPT_APART = (
    "policy",
    "form",
    "arm",
    "delivery",
    "split",
    "wordings",
    "max_steps",
    "meshes",
    "observe_every",
    "demonstration_frames",
    "language_version",
    "environment_version",
    "policy_version",
    "robot",
    "policy_label",
    "instruction_options",
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
        p_holm: p-value of the gap after Holm's correction over its family.
    """

    key: K
    cells: ByTask
    others: ByTask = field(default_factory=dict)
    interval: Interval | None = None
    gap: Gap | None = None
    second_gap: Gap | None = None
    p_holm: float | None = None

    @property
    def tasks(self) -> tuple[str, ...]:
        """Tasks with a verdict."""
        return tuple(task for task, cell in self.cells.items() if cell.verdicts)

    @property
    def counts(self) -> Counts:
        """The sums over tasks."""
        columns = zip(*(cell.counts for cell in self.cells.values()), strict=True)
        return Counts(*map(sum, columns))

    @property
    def rate(self) -> Fraction | None:
        """Unweighted mean of the tasks' success rates; None without a verdict."""
        return mean_rate(self.cells)


def mean_rate(cells: ByTask) -> Fraction | None:
    """Return the unweighted mean of the tasks' success rates; None without a verdict."""
    rates = [cell.rate for cell in cells.values() if cell.rate is not None]
    if not rates:
        return None
    return sum(rates, Fraction(0)) / len(rates)


def measure(
    frame: Columns,
    by: Sequence[str],
    against: Mapping[str, object] | None = None,
    family: Sequence[str] = (),
    pool: Sequence[str] = (),
) -> tuple[Measured[Key], ...]:
    """Measure success in each group of episodes, as the mean over tasks.

    Args:
        frame: as `roboirg.results` returns it, with columns of your own if you like.
        by: columns whose values make a group.
        against: values of some of these columns that make the group to compare with, such as
            ``{"setting": "explicit"}``; the gap is on the same episodes and policy seeds.
        family: columns of `by` within whose values p-values are corrected together.
        pool: columns over whose values a rate may be taken, such as ``["form"]``. In the others
            that distinguish policies, words and conditions, all rows of a group have one value.

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
    return _measure_against(_trials_of_groups(frame, by, pool), by, changed, family)


def _trials_of_groups(
    frame: Columns, by: Sequence[str], pool: Sequence[str]
) -> Mapping[Key, ByTask]:
    """Group trials by the values of some columns, after checking that each group can be one rate.

    A rate must not mix, for example, two policies or two versions, unless the caller allows it.

    Args:
        frame: with the columns.
        by: columns whose values make a group.
        pool: columns over whose values a rate may be taken.

    Raises:
        InvalidValueError: a group has several values in a column of `KEPT_APART` that is not
            pooled, or several rows of the same trial.
    """
    named = (*by, *pool)
    unmixed = [name for name in KEPT_APART if name in frame and name not in named]
    rows = _known_rows(frame, (*named, *unmixed, *TRIAL))
    _check_unmixed(rows, by, unmixed)
    # What is pooled distinguishes trials of an episode, as the policy seed does, so it becomes part
    # of the seed: a trial of the resolved form has the seed (0, "resolved").
    rows["policy_seed"] = list(rows_of(rows, "policy_seed", *pool))
    groups = gather(rows, by)
    if _trials_in(groups) < len(rows["task"]):
        raise InvalidValueError(
            "Several rows of a group are about the same trial of an episode; choose some of them, "
            f"or group by a column in which they differ, next to {', '.join(by)}."
        )
    return groups


def _measure_against(
    groups: Mapping[Key, ByTask],
    by: Sequence[str],
    changed: Mapping[str, object],
    family: Sequence[str],
) -> tuple[Measured[Key], ...]:
    """Measure success in groups, and its gap to the group that differs only in some columns.

    Args:
        groups: by the values of the columns of `by`.
        by: names of columns, such as ``["policy", "setting"]``.
        changed: what differs in the reference, such as ``{"setting": "explicit"}``: that of
            ``("oracle", "direct")`` is ``("oracle", "explicit")``.
        family: columns within whose values p-values are corrected together.
    """

    def reference(key: Key) -> ByTask:
        values = zip(by, key, strict=True)
        reference_key = tuple(changed.get(name, value) for name, value in values)
        if reference_key == key:
            return NOTHING  # nothing is compared with itself
        return groups.get(reference_key, NOTHING)

    def family_of(key: Key) -> Key:
        values = dict(zip(by, key, strict=True))
        return tuple(values[name] for name in family)

    return measure_groups(groups, reference, family=family_of)


def _known_rows(frame: Columns, names: Iterable[str]) -> dict[str, list[object]]:
    """Return some columns of a frame as lists, with None for values that pandas marks as missing.

    Raises:
        InvalidValueError: a value is missing in a column of `TRIAL`: task, episode, policy seed,
            outcome.
    """
    rows = {}
    for name in names:
        rows[name] = list(map(_known, frame[name]))
        if name in TRIAL and None in rows[name]:
            raise InvalidValueError(f"The column {name!r} has no value in some row; fill it in.")
    return rows


def _trials_in(groups: Mapping[Key, ByTask]) -> int:
    """Return the number of trials in some groups: with a verdict, ended in an error, or missing.

    If several rows are about the same trial (episode and policy seed), it counts once, because a
    cell keeps only the last verdict.
    """
    trials = 0
    for by_task in groups.values():
        for cell in by_task.values():
            trials += len(cell.verdicts) + cell.errors + cell.missing + cell.spared
    return trials


def _known(value: object) -> object:
    """Return a value, or None for pandas's many missing ones, which are not equal to themselves."""
    is_missing = type(value).__name__ == "NAType" or value != value  # noqa: PLR0124
    return None if is_missing else value


def _check_unmixed(
    rows: Mapping[str, Sequence[object]], by: Sequence[str], unmixed: Iterable[str]
) -> None:
    """Check that in some columns all rows of a group have the same value.

    Args:
        rows: columns of equal length.
        by: columns whose values make a group.
        unmixed: the columns that are checked.

    Raises:
        InvalidValueError: a group has several values in one of them.
    """
    for name in unmixed:
        # If each group has one value, there are as many pairs of group and value as groups.
        groups_with_value = set(rows_of(rows, *by, name))
        groups = {values[:-1] for values in groups_with_value}
        if len(groups_with_value) > len(groups):
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
    """Check the arguments of `measure`.

    Raises:
        UnknownNameError: the frame lacks a column that is named, or a value of `against`.
        InvalidValueError: a column stands twice, or one of `family` or `against` is not in `by`.
    """
    columns = list(map(str, frame))
    check_names("column", (*by, *family, *against, *pool, *TRIAL), columns)
    for name, count in Counter(columns).items():
        if count > 1:
            raise InvalidValueError(f"The frame has several columns {name!r}; keep one.")
    for name in (*family, *against):
        if name not in by:
            raise InvalidValueError(f"The column {name!r} is not in by: {', '.join(by)}.")
    _check_values(frame, against)


def _check_values(frame: Columns, wanted: Mapping[str, object]) -> None:
    """Check that some row of a frame has each wanted value in its column."""
    for name, value in wanted.items():
        known = set(frame[name])
        if value not in known:
            raise UnknownNameError(f"row with the {name}", value, sorted(map(str, known)))


def _no_reference(_key: Key) -> ByTask:
    return NOTHING


def measure_groups(
    groups: Mapping[K, ByTask],
    reference: Callable[[K], ByTask] = _no_reference,
    second_reference: Callable[[K], ByTask] = _no_reference,
    *,
    family: Callable[[K], object] = lambda _key: None,
    with_intervals: bool = True,
) -> tuple[Measured[K], ...]:
    """Measure success in groups of trials, and its gaps to others on the same episodes.

    Args:
        groups: for each key its trials by task; the rate of a group is the mean over tasks.
        reference: returns the trials with which those of the key are compared; none by default.
        second_reference: returns others with which they are compared, too.
        family: returns the same value for groups that are read together: p-values of their gaps
            are corrected over all of them.
        with_intervals: whether rates have intervals.
    """
    # A task is in several groups, alone and in averages, and is paired once.
    pairs_of = functools.cache(Pairs.of)
    measured = []
    for key, cells in groups.items():
        interval = rate_interval(cells.values()) if with_intervals else None
        others = reference(key)
        gap = measure_gap(pair(cells, others, pairs_of))
        second_gap = measure_gap(pair(cells, second_reference(key), pairs_of))
        measured.append(Measured(key, cells, others, interval, gap, second_gap))
    return with_holm(measured, family)


def with_holm(
    rows: Sequence[Measured[K]], family: Callable[[K], object]
) -> tuple[Measured[K], ...]:
    """Correct p-values for testing several gaps at once, by Holm's method.

    The gaps that are read together, such as those of a policy run, are a family, and are corrected
    over its rows. Rows without a gap stay as they are.

    Args:
        rows: in any order, which is kept.
        family: returns what the family of a row is called, given the row's key.
    """
    # For each family its p-values, by the number of the row.
    families: defaultdict[object, dict[int, float]] = defaultdict(dict)
    for number, row in enumerate(rows):
        if row.gap is not None:
            families[family(row.key)][number] = row.gap.p_value
    corrected = list(rows)
    for p_values in families.values():
        corrected_p_values = holm(list(p_values.values()))
        for number, p_value in zip(p_values, corrected_p_values, strict=True):
            corrected[number] = replace(rows[number], p_holm=p_value)
    return tuple(corrected)


def pair(
    cells: ByTask, others: ByTask, pairs_of: Callable[[Cell, Cell], Pairs] = Pairs.of
) -> list[Pairs]:
    """Pair trials by episode, in each task in which both sides have some, by a function."""
    pairs = []
    for task, cell in cells.items():
        if cell.verdicts and task in others:
            pairs.append(pairs_of(cell, others[task]))
    return pairs


class ScopeKey(NamedTuple):
    """Policy run, scope (a task, a suite, or `ALL_TASKS`) and instruction options."""

    policy_run: PolicyRun
    scope: str
    options: InstructionOptions


ScopeSummary = Measured[ScopeKey]
"""What was measured in a scope."""
Summaries = Mapping[ScopeKey, ScopeSummary]


def by_scope(cells: Cells) -> Mapping[ScopeKey, ByTask]:
    """Group the cells of tasks by what is averaged: a task, a suite of tasks, or all tasks.

    These are the scopes. The cell of the task ``StopCube`` is in three groups: ``StopCube``, its
    suite ``permanence``, and ``all tasks``. Groups of tasks come first, those of all tasks last.
    """
    scopes: dict[ScopeKey, dict[str, Cell]] = {}

    def add(scope: str, key: CellKey) -> None:
        in_scope = scopes.setdefault(ScopeKey(key.policy_run, scope, key.options), {})
        in_scope[key.task] = cells[key]

    for key in cells:
        add(key.task, key)
    for key in cells:
        suite_of_task = suite(key.task)
        if suite_of_task is not None:
            add(suite_of_task, key)
    for key in cells:
        add(ALL_TASKS, key)
    return scopes


def summarize(cells: Cells, wanted: Collection[str] | None = None) -> Summaries:
    """Measure the success of each policy run by instruction options, in tasks, suites and overall.

    The first gap is to explicit instructions, which name the goal; the second one to the resolved
    form of the same instructions, whose references are replaced by what they mean. P-values are
    corrected over a policy run's tasks, its suites, or its averages over all tasks. A suite with a
    single task is shown nowhere, so it is in no family with others.

    Args:
        cells: of all policy runs.
        wanted: names of tasks or suites, or `ALL_TASKS`; None for all of them.
    """
    scopes = by_scope(cells)
    groups = scopes
    if wanted is not None:
        groups = {key: by_task for key, by_task in scopes.items() if key.scope in wanted}

    def with_options(key: ScopeKey, options: InstructionOptions) -> ByTask:
        if options == key.options:
            return NOTHING
        return scopes.get(key._replace(options=options), NOTHING)

    families = _families(scopes)
    found = measure_groups(
        groups,
        lambda key: with_options(key, REFERENCE_OPTIONS),
        lambda key: with_options(key, replace(key.options, form="resolved")),
        family=lambda key: (key.policy_run, families[key.scope]),
    )
    return {row.key: only_what_holds(row, row.key.policy_run) for row in found}


def only_what_holds(row: Measured[K], policy_run: PolicyRun) -> Measured[K]:
    """Return a row without intervals and p-values if its run stopped when it was decided.

    They are for a number of episodes that does not depend on the results.
    """
    if not policy_run.is_until_decided:
        return row
    return replace(row, interval=None, gap=None, second_gap=None, p_holm=None)


def _families(scopes: Mapping[ScopeKey, ByTask]) -> dict[str, str]:
    """Return for each scope with which others it is read: tasks, suites, or all tasks.

    A suite with a single task is ``alone``.
    """
    tasks: defaultdict[str, set[str]] = defaultdict(set)
    for key, by_task in scopes.items():
        tasks[key.scope].update(by_task)
    families = {}
    for scope, names in tasks.items():
        if scope == ALL_TASKS:
            families[scope] = ALL_TASKS
        elif scope in names:  # the cells of a scope are by the names of its tasks
            families[scope] = "tasks"
        else:
            families[scope] = "suites" if len(names) > 1 else "alone"
    return families
