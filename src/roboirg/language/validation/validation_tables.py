"""The proof on the terminal: what was read, what failed, and which exceptions there are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import TypeVar

from rich.table import Table

from roboirg.core.episode import DIFFICULTIES
from roboirg.language.landmarks import FRAMES
from roboirg.language.settings import setting_names
from roboirg.language.validation.evidence import CommandGroup, LandmarkGroup, ValidationResults
from roboirg.tasks import every_task

Group = TypeVar("Group", CommandGroup, LandmarkGroup)

NONE = "–"
"""Where a task has no such setting."""


def validation_tables(found: ValidationResults) -> Iterator[Table]:
    """Texts and failures, exceptions of necessity, scenes without a landmark."""
    yield _texts(found)
    yield _exceptions(found)
    if found.scenes:
        yield _landmarks(found)


def _texts(found: ValidationResults) -> Table:
    table = _table(
        "Texts read back, and rules broken", ("task",), (*setting_names(), "broken rules")
    )
    broken = Counter((failure.task, failure.setting) for failure in found.failures)
    tasks = _tasks(task for task, _ in found.texts)
    for task in tasks:
        cells = [_count(found.texts, broken, (task, setting)) for setting in setting_names()]
        table.add_row(
            task, *cells, f"{sum(broken[task, setting] for setting in setting_names()):,}"
        )
    if len(tasks) > 1:
        sums = [sum(found.texts[task, setting] for task in tasks) for setting in setting_names()]
        table.add_section()
        table.add_row("all tasks", *(f"{one:,}" for one in sums), f"{broken.total():,}")
    return table


def _count(
    texts: Mapping[tuple[str, str], int],
    broken: Mapping[tuple[str, str], int],
    group: tuple[str, str],
) -> str:
    """``120``, or ``120 (2 broken)``."""
    if group not in texts:
        return NONE
    return (
        f"{texts[group]:,} ({broken[group]:,} broken)" if group in broken else f"{texts[group]:,}"
    )


def _exceptions(found: ValidationResults) -> Table:
    """One row for each task and way of telling that has any exception."""
    table = _table(
        "Commands that tell the goal alone: the scene leaves one candidate",
        ("task", "setting", "pattern"),
        DIFFICULTIES,
    )
    ways = {group[:3] for group, count in found.exceptions.items() if count}
    for way in (group for group in _ordered(found.commands) if group in ways):
        groups = [CommandGroup(*way, difficulty) for difficulty in DIFFICULTIES]
        shares = [_share(found.exceptions, found.commands, group) for group in groups]
        task, setting, pattern = way
        table.add_row(task, setting, pattern or "", *shares)
    if not ways:
        table.add_row("none")
    return table


def _ordered(commands: Iterable[CommandGroup]) -> list[tuple[str, str, str | None]]:
    ways = {(one.task, one.setting, one.pattern) for one in commands}
    tasks = _tasks(task for task, _, _ in ways)
    return sorted(ways, key=lambda way: (tasks.index(way[0]), way[1], way[2] or ""))


def _landmarks(found: ValidationResults) -> Table:
    columns = [f"{difficulty}, {frame}" for frame in FRAMES for difficulty in DIFFICULTIES]
    table = _table("Scenes without a landmark, by difficulty and frame", ("task",), columns)
    for task in _tasks(group.task for group in found.scenes):
        groups = [
            LandmarkGroup(task, difficulty, frame)
            for frame in FRAMES
            for difficulty in DIFFICULTIES
        ]
        table.add_row(task, *(_share(found.unplaced, found.scenes, group) for group in groups))
    return table


def _share(some: Mapping[Group, int], all_: Mapping[Group, int], group: Group) -> str:
    """``3 of 120 (2.5 %)``."""
    count, total = some.get(group, 0), all_.get(group, 0)
    if not total:
        return NONE
    return f"{count:,} of {total:,} ({100 * count / total:.2f} %)" if count else f"0 of {total:,}"


def _tasks(names: Iterable[str]) -> list[str]:
    # Evidence comes in any order; tables have that of the registry.
    present = set(names)
    return [task for task in every_task() if task in present]


def _table(title: str, names: Iterable[str], numbers: Iterable[str]) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold")
    for name in names:
        table.add_column(name)
    for name in numbers:
        table.add_column(name, justify="right")
    return table
