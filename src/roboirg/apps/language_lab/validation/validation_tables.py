"""Tables of validation results for the terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import TypeVar

from rich.table import Table

from roboirg.apps.language_lab.validation.validation_results import (
    CommandGroup,
    SceneGroup,
    ValidationResults,
)
from roboirg.core.episode import DIFFICULTIES
from roboirg.core.plain_text import counted
from roboirg.language.settings import setting_names
from roboirg.tasks import every_task

Group = TypeVar("Group", CommandGroup, SceneGroup)

NONE = "–"
"""Cell of a task that lacks the setting."""


def validation_tables(results: ValidationResults) -> Iterator[Table]:
    """Yield tables of texts and violations, exceptions of necessity, and refused scenes."""
    yield _texts(results)
    yield _exceptions(results)
    for setting in setting_names():
        if any(group.setting == setting for group in results.scenes):
            yield _refusals(results, setting)


def _texts(results: ValidationResults) -> Table:
    names, texts = setting_names(), results.texts
    table = _table("Texts read back, and rules broken", ("task",), (*names, "broken rules"))
    broken = Counter((failure.task, failure.setting) for failure in results.failures)
    tasks = _tasks(task for task, _ in texts)
    for task in tasks:
        cells = [_count(texts, broken, (task, setting)) for setting in names]
        table.add_row(task, *cells, f"{sum(broken[task, setting] for setting in names):,}")
    if len(tasks) > 1:
        sums = [sum(texts[task, setting] for task in tasks) for setting in names]
        table.add_section()
        table.add_row("all tasks", *(f"{one:,}" for one in sums), f"{broken.total():,}")
    return table


def _count(
    texts: Mapping[tuple[str, str], int],
    broken: Mapping[tuple[str, str], int],
    group: tuple[str, str],
) -> str:
    """Return ``120``, or ``120 (2 broken)``."""
    if group not in texts:
        return NONE
    return (
        f"{texts[group]:,} ({broken[group]:,} broken)" if group in broken else f"{texts[group]:,}"
    )


def _exceptions(results: ValidationResults) -> Table:
    """Return one row for each task, setting and pattern with exceptions."""
    table = _table(
        "Commands that give the goal alone: the scene leaves one candidate",
        ("task", "setting", "pattern"),
        DIFFICULTIES,
    )
    excepted = {group[:3] for group, count in results.exceptions.items() if count}
    for row in (group for group in _ordered(results.commands) if group in excepted):
        groups = [CommandGroup(*row, difficulty) for difficulty in DIFFICULTIES]
        shares = [_share(results.exceptions, results.commands, group) for group in groups]
        task, setting, pattern = row
        table.add_row(task, setting, pattern or "", *shares)
    if not excepted:
        table.add_row("none")
    return table


def _ordered(commands: Iterable[CommandGroup]) -> list[tuple[str, str, str | None]]:
    rows = {(one.task, one.setting, one.pattern) for one in commands}
    tasks = _tasks(task for task, _, _ in rows)
    return sorted(rows, key=lambda row: (tasks.index(row[0]), row[1], row[2] or ""))


def _refusals(results: ValidationResults, setting: str) -> Table:
    """Return the share of refused scenes by task, with the reasons below."""
    scenes = [group for group in results.scenes if group.setting == setting]
    columns = [
        (variant, difficulty)
        for variant in dict.fromkeys(group.variant for group in scenes)
        for difficulty in DIFFICULTIES
    ]
    headers = [", ".join(filter(None, (difficulty, variant))) for variant, difficulty in columns]
    table = _table(f"Scenes that the {setting} setting cannot express", ("task",), headers)
    for task in _tasks(group.task for group in scenes):
        groups = [SceneGroup(task, setting, *column) for column in columns]
        shares = [_share(results.refused, results.scenes, group) for group in groups]
        table.add_row(task, *shares)
    table.caption = _reasons(results, setting)
    return table


def _reasons(results: ValidationResults, setting: str) -> str | None:
    """Return one line for each reason, the most common one first; None without refusals."""
    lines = [
        f"{refusal.reason}: {counted(count, 'refusal')}"
        for refusal, count in results.reasons.most_common()
        if refusal.setting == setting
    ]
    return "\n".join(lines) or None


def _share(some: Mapping[Group, int], all_: Mapping[Group, int], group: Group) -> str:
    """Return ``3 of 120 (2.5 %)``."""
    count, total = some.get(group, 0), all_.get(group, 0)
    if not total:
        return NONE
    return f"{count:,} of {total:,} ({100 * count / total:.2f} %)" if count else f"0 of {total:,}"


def _tasks(names: Iterable[str]) -> list[str]:
    # Results come in any order; tables have that of the registry.
    present = set(names)
    return [task for task in every_task() if task in present]


def _table(title: str, names: Iterable[str], numbers: Iterable[str]) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", caption_justify="left")
    for name in names:
        table.add_column(name)
    for name in numbers:
        table.add_column(name, justify="right")
    return table
