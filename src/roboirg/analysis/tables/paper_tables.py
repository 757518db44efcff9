"""The tables of the paper, from samples: main, planners, context, real world, coverage."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Literal, NamedTuple, get_args

import numpy as np

from roboirg.analysis.published import (
    AVERAGE,
    PublishedRow,
    RateTable,
    published_coverage,
    published_rows,
    published_tasks,
)
from roboirg.analysis.stats.chance import chance_level
from roboirg.analysis.stats.rates import percent
from roboirg.analysis.stats.samples import CellResults, PolicyRun, Samples, labels, shown_interval
from roboirg.analysis.stats.success_rates import EXPLICIT, SETTING_ORDER, SettingColumn
from roboirg.analysis.tables.table import (
    ERROR_MARK,
    MISSING_MARK,
    Column,
    Counts,
    Entry,
    Row,
    Table,
    averaged,
    with_best,
    with_changes,
)
from roboirg.analysis.tables.table_notes import notes_of
from roboirg.core.errors import UnknownNameError
from roboirg.language import STAGE_SETS, settings_of
from roboirg.records.record import Job
from roboirg.tasks import all_tasks

Which = Literal["main", "planner", "context", "real", "coverage"]
WHICH: tuple[Which, ...] = get_args(Which)

OVERALL = AVERAGE
OWN_NAME = "RoboIRGBench"
CHANCE = "chance"
SEED = 20_240_607
"""Of the bootstrap behind the intervals; the same records give the same tables."""

TITLES: Mapping[Which, str] = {
    "main": "Success by task and setting",
    "planner": "High-level planners",
    "context": "Stages of the contextual setting",
    "real": "Real world",
    "coverage": "Implicit references in benchmarks",
}
SHORTEST_CONTEXT = STAGE_SETS[0]


class Place(NamedTuple):
    """Where a row stands: its group, its name, and how its episodes were told."""

    group: str
    name: str
    variant: SettingColumn


def make_table(
    which: str, samples: Samples, *, published: bool = False, chance: bool = False
) -> Table:
    """One of the paper's tables.

    Args:
        which: main, planner, context, real or coverage.
        samples: as `gather` makes them; may be empty where published rows are shown.
        published: whether the paper's own rows stand beside ours.
        chance: whether the chance level stands below the policies.

    Raises:
        UnknownNameError: there is no such table.
    """
    for known in WHICH:
        if which == known:
            if known == "coverage":
                return _coverage()
            return _rate_table(known, samples, published=published, chance=chance)
    raise UnknownNameError("table", which, WHICH)


def has_something_to_say(which: Which, samples: Samples) -> bool:
    """Whether a run holds more than one row of a table, or anything at all of the main ones."""
    if which == "coverage":
        return True
    rows = list(_our_places(which, samples))
    if which == "planner":
        return len({who for who, _ in rows}) > 1
    if which == "context":
        return len({place.variant for _, place in rows}) > 1
    return bool(rows)


def _rate_table(which: RateTable, samples: Samples, *, published: bool, chance: bool) -> Table:
    columns = _columns(which)
    rng = np.random.default_rng(SEED)
    rows = [
        Row(
            place.group,
            place.name,
            "ours",
            averaged(columns, _our_entries(which, who, place.variant, samples, rng)),
        )
        for who, place in _our_places(which, samples)
    ]
    if chance:
        rows += _chance_rows(which, columns, samples)
    if published:
        rows += [_published_row(which, columns, row) for row in published_rows(which)]
    rows = with_best(with_changes(columns, _grouped(which, rows), _referee(which, rows)))
    return Table(
        key=which,
        title=TITLES[which],
        heads=("policy", "stages") if which == "context" else ("setting", "policy"),
        columns=columns,
        rows=tuple(rows),
        notes=notes_of(which, rows, samples, published_tasks(which)),
    )


def _columns(which: RateTable) -> tuple[Column, ...]:
    """Tasks by suite with the suite's average in the main table; the overall average last."""
    tasks = published_tasks(which)
    if which != "main":
        return (*(Column(task) for task in tasks), Column(OVERALL, averages=tasks))
    registry = all_tasks()
    suites: dict[str, list[str]] = {}
    for task in tasks:
        suites.setdefault(registry[task].suite, []).append(task)
    columns: list[Column] = []
    for suite, names in suites.items():
        group = suite.capitalize()
        columns += [Column(name, group) for name in names]
        columns.append(Column(f"{group} {AVERAGE}", group, tuple(names)))
    return (*columns, Column(OVERALL, averages=tasks))


def _our_places(which: RateTable, samples: Samples) -> Iterator[tuple[PolicyRun, Place]]:
    tasks = set(published_tasks(which))
    played = {(who, variant) for who, task, variant in samples if task in tasks}
    names = labels(samples)
    for who, name in names.items():
        for variant in _variants(which):
            if (who, variant) in played:
                yield who, _place(which, name, variant)


def _variants(which: RateTable) -> list[SettingColumn]:
    if which == "context":
        return [SettingColumn("contextual", stages=stages) for stages in STAGE_SETS]
    return [EXPLICIT._replace(setting=setting) for setting in SETTING_ORDER]


def _place(which: RateTable, policy: str, variant: SettingColumn) -> Place:
    if which == "context":
        return Place(policy, _stages(variant), variant)
    return Place(variant.setting, policy, variant)


def _stages(variant: SettingColumn) -> str:
    return ",".join(map(str, variant.stages))


def _our_entries(
    which: RateTable,
    who: PolicyRun,
    variant: SettingColumn,
    samples: Samples,
    rng: np.random.Generator,
) -> dict[str, Entry]:
    return {
        task: _entry(samples.get((who, task, variant)), _applies(task, variant), rng)
        for task in published_tasks(which)
    }


def _entry(sample: CellResults | None, applies: bool, rng: np.random.Generator) -> Entry:
    if sample is None:
        return Entry(applies=applies)
    marks = (ERROR_MARK if sample.errors else "") + (MISSING_MARK if sample.missing else "")
    return Entry(
        percent=None if sample.rate is None else percent(sample.rate),
        marks=marks,
        counts=Counts(
            sample.successes,
            sample.trials,
            len(sample.by_episode()),
            sample.errors,
            sample.missing,
            shown_interval(sample, rng),
        ),
    )


def _applies(task: str, variant: SettingColumn) -> bool:
    known = all_tasks().get(task)
    return known is None or variant.setting in settings_of(known)


def _chance_rows(which: RateTable, columns: Sequence[Column], samples: Samples) -> list[Row]:
    """The chance level of each telling, on the episodes that anybody played in it."""
    rows: list[Row] = []
    if which == "context":
        return rows
    for variant in dict.fromkeys(place.variant for _, place in _our_places(which, samples)):
        cells = {}
        for task in published_tasks(which):
            level = _chance(task, variant, samples)
            applies = _applies(task, variant)
            cells[task] = Entry(None if level is None else percent(level), applies=applies)
        rows.append(Row(variant.setting, CHANCE, "chance", averaged(columns, cells)))
    return rows


def _chance(task: str, variant: SettingColumn, samples: Samples) -> Fraction | None:
    if task not in all_tasks():
        return None
    return chance_level(
        Job(policy="", task=task, split=who.rules.split, episode=trial.episode, **variant._asdict())
        for (who, played, told), sample in samples.items()
        if (played, told) == (task, variant)
        for trial in sample.verdicts
    )


def _published_row(which: RateTable, columns: Sequence[Column], row: PublishedRow) -> Row:
    cells = {
        task: Entry(percent=rate, applies=rate is not None) for task, rate in row.rates.items()
    }
    entries = averaged(columns, cells)
    place = _place(which, row.model, row.variant)
    # The overall average as it is printed in the paper; those of suites are not printed there.
    entries = (*entries[:-1], Entry(percent=row.average))
    return Row(place.group, place.name, "published", entries)


def _grouped(which: RateTable, rows: Iterable[Row]) -> list[Row]:
    """The rows of each group together; settings in their order, policies as they come."""
    found = list(rows)
    groups = list(dict.fromkeys(row.group for row in found))
    if which != "context":
        groups.sort(key=SETTING_ORDER.index)
    return [row for group in groups for row in found if row.group == group]


def _referee(which: RateTable, rows: Sequence[Row]) -> Callable[[Row], Row | None]:
    """With which row another is compared: explicit of the same policy, or the shortest context."""
    by_place = {(row.group, row.name, row.source): row for row in rows}
    shortest = ",".join(map(str, SHORTEST_CONTEXT))

    def reference_of(row: Row) -> Row | None:
        if row.source == "chance":
            return None
        if which == "context":
            found = by_place.get((row.group, shortest, row.source))
        else:
            found = by_place.get((EXPLICIT.setting, row.name, row.source))
        is_itself = found is not None and (found.group, found.name) == (row.group, row.name)
        return None if is_itself else found

    return reference_of


def _coverage() -> Table:
    """The paper's table; the row of this benchmark is read off its tasks."""
    rows = published_coverage()
    kinds = tuple(rows[0].covers)
    has = {setting for task in all_tasks().values() for setting in settings_of(task)}
    drawn = []
    for row in rows:
        words = {kind: "yes" if kind in has else "no" for kind in kinds}
        is_own = row.benchmark == OWN_NAME
        entries = tuple(Entry(word=word) for word in (words if is_own else row.covers).values())
        drawn.append(Row(row.kind, row.benchmark, "ours" if is_own else "cited", entries))
    return Table(
        key="coverage",
        title=TITLES["coverage"],
        heads=("kind", "benchmark"),
        columns=tuple(Column(kind) for kind in kinds),
        rows=tuple(drawn),
        notes=("partial: pronouns within a chain of actions only. As the paper has it.",),
    )
