"""Tables of validation results for the terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

from rich import box
from rich.table import Table

from roboirg.apps.language_lab.validation.validation_results import EpisodeGroup, ValidationResults
from roboirg.core.episode import DIFFICULTIES, Difficulty
from roboirg.core.plain_text import counted
from roboirg.language.settings import plain_settings
from roboirg.tasks import every_task

HARDER = "harder"
"""Column of the harder settings, such as direct-rival."""
NONE = "–"
"""Cell of a task that lacks the setting."""


def validation_tables(results: ValidationResults) -> Iterator[Table]:
    """Yield tables of texts and violations, exceptions of necessity, and refused scenes."""
    yield _texts(results)
    yield _exceptions(results)
    yield _refusals(results)


def _texts(results: ValidationResults) -> Table:
    """Return the number of texts of each task and setting; the harder settings share a column."""
    names = plain_settings()
    texts, broken = Counter[tuple[str, str]](), Counter[tuple[str, str]]()
    for (task, setting), count in results.texts.items():
        texts[task, setting if setting in names else HARDER] += count
    for failure in results.failures:
        broken[failure.task, failure.setting if failure.setting in names else HARDER] += 1
    columns = (*names, HARDER)
    table = _table("Texts read back, and rules broken", ("task",), (*columns, "bad"))
    tasks = _tasks(task for task, _ in texts)
    for task in tasks:
        cells = [_count(texts, broken, (task, setting)) for setting in columns]
        table.add_row(task, *cells, f"{sum(broken[task, setting] for setting in columns):,}")
    if len(tasks) > 1:
        sums = [sum(texts[task, setting] for task in tasks) for setting in columns]
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
    """Return the commands that give the goal alone, by task, setting and pattern."""
    title = "Commands that give the goal alone: the scene leaves one candidate"
    return _shares(title, "setting, pattern", results.exceptions, results.commands)


def _refusals(results: ValidationResults) -> Table:
    """Return the scenes that settings refuse, by task and variant, with the reasons below."""
    title = "Scenes that a setting cannot express"
    table = _shares(title, "setting, options", results.refused, results.scenes)
    reasons = (
        f"{refusal.setting}: {refusal.reason}: {counted(count, 'refusal')}"
        for refusal, count in results.reasons.most_common()
    )
    table.caption = "\n".join(reasons) or None
    return table


def _shares(
    title: str, kind: str, counts: Counter[EpisodeGroup], totals: Counter[EpisodeGroup]
) -> Table:
    """Return a row ``3 of 120`` by difficulty for each task and kind of which there are some."""
    some, all_ = (Counter[tuple[str, str, Difficulty]]() for _ in range(2))
    for one, total in totals.items():
        key = (one.task, ", ".join(filter(None, (one.setting, one.detail))), one.difficulty)
        all_[key] += total
        some[key] += counts[one]
    table = _table(title, ("task", kind), DIFFICULTIES)
    rows = {key[:2] for key, count in some.items() if count}
    for task in _tasks(task for task, _ in rows):
        for label in sorted(label for one, label in rows if one == task):
            cells = ((some[task, label, one], all_[task, label, one]) for one in DIFFICULTIES)
            shown = (f"{count:,} of {total:,}" if total else NONE for count, total in cells)
            table.add_row(task, label, *shown)
    if not rows:
        table.add_row("none")
    return table


def _tasks(names: Iterable[str]) -> list[str]:
    # Results come in any order; tables have that of the registry.
    present = set(names)
    return [task for task in every_task() if task in present]


def _table(title: str, names: Iterable[str], numbers: Iterable[str]) -> Table:
    # Without side lines and double blanks a line has room for all settings at 80 characters.
    table = Table(
        title=title,
        title_justify="left",
        title_style="bold",
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        show_edge=False,
        collapse_padding=True,
        pad_edge=False,
    )
    for name in names:
        table.add_column(name, no_wrap=name == "task")
    for name in numbers:
        table.add_column(name, justify="right")
    return table
