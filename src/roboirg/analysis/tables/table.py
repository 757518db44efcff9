"""What a table is before it is drawn: rows of entries, each with all that its renderings show."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Literal, NamedTuple

from roboirg.analysis.stats.intervals import Interval
from roboirg.analysis.stats.rates import Change, change, mean_percent

Source = Literal["ours", "published", "cited", "chance"]
"""Whose figures: the run's, the paper's about the same thing, the paper's about something else, or
computed."""

NOT_APPLICABLE = "–"
ERROR_MARK = "!"
MISSING_MARK = "…"
PARTIAL_MARK = "*"


class Counts(NamedTuple):
    """What is behind an entry.

    Attributes:
        successes: trials.
        trials: with a verdict.
        episodes: with a verdict.
        errors: trials that ended in an error.
        missing: trials of the plan without a result.
        interval: of the rate, 95 %; None without.
    """

    successes: int = 0
    trials: int = 0
    episodes: int = 0
    errors: int = 0
    missing: int = 0
    interval: Interval | None = None


@dataclass(frozen=True, slots=True)
class Entry:
    """One cell of a table.

    Attributes:
        percent: as printed; None where there is nothing to print.
        word: said instead of a rate; empty in tables of rates.
        applies: False where the setting is not defined for the task.
        change: against the row that this one is compared with; None without, or where either is
            incomplete.
        best: whether it is the best, or among the best, of its group.
        marks: what is amiss, as in the constants above.
        counts: behind it; None where they are not known.
    """

    percent: Decimal | None = None
    word: str = ""
    applies: bool = True
    change: Change | None = None
    best: bool = False
    marks: str = ""
    counts: Counts | None = None

    @property
    def text(self) -> str:
        """The rate, a dash where there can be none, or the word; empty where nothing was played."""
        if self.word:
            return self.word
        if not self.applies:
            return NOT_APPLICABLE
        return "" if self.percent is None else str(self.percent)


class Column(NamedTuple):
    """A column of entries.

    Attributes:
        name: a task, or what an average is of.
        group: the suite, or empty.
        averages: of an average the columns it is taken over; empty for a task.
    """

    name: str
    group: str = ""
    averages: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Row:
    """A row of a table.

    Attributes:
        group: the setting or policy that it stands under.
        name: of the row in its group.
        source: whose figures they are.
        entries: one for each column.
    """

    group: str
    name: str
    source: Source
    entries: tuple[Entry, ...]

    @property
    def label(self) -> str:
        """Its name, and that it is published where it is."""
        return f"{self.name} (published)" if self.source == "published" else self.name


@dataclass(frozen=True, slots=True)
class Table:
    """A table, ready to be drawn.

    Attributes:
        key: a short name, good as a file name.
        title: of the table.
        heads: what the groups and the names of the rows are.
        columns: of the entries.
        rows: those of a group stand together.
        notes: sentences below it.
    """

    key: str
    title: str
    heads: tuple[str, str]
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()

    def groups(self) -> dict[str, list[Row]]:
        """The rows by group, in order."""
        groups: dict[str, list[Row]] = {}
        for row in self.rows:
            groups.setdefault(row.group, []).append(row)
        return groups


def averaged(columns: Sequence[Column], cells: Mapping[str, Entry]) -> tuple[Entry, ...]:
    """A row's entries: those of its tasks, and the averages over them.

    An average is over the tasks that apply and have a rate, and marked where one of them has none
    or is incomplete itself.
    """
    return tuple(
        _average([cells[name] for name in column.averages])
        if column.averages
        else cells[column.name]
        for column in columns
    )


def _average(cells: Sequence[Entry]) -> Entry:
    applying = [cell for cell in cells if cell.applies]
    if not applying:
        return Entry(applies=False)
    rates = [cell.percent for cell in applying if cell.percent is not None]
    if not rates:
        return Entry()
    amiss = len(rates) < len(applying) or any(cell.marks for cell in applying)
    return Entry(percent=mean_percent(rates), marks=PARTIAL_MARK if amiss else "")


def with_changes(
    columns: Sequence[Column], rows: Iterable[Row], reference_of: Callable[[Row], Row | None]
) -> list[Row]:
    """The rows with what changed against others.

    An average is compared with the other row's average over the same tasks, so that a setting
    which some tasks lack is not compared with all of them.
    """
    return [
        replace(
            row,
            entries=tuple(
                replace(entry, change=_change(columns, index, row, reference))
                for index, entry in enumerate(row.entries)
            ),
        )
        if (reference := reference_of(row)) is not None
        else row
        for row in rows
    ]


def _change(columns: Sequence[Column], index: int, row: Row, reference: Row) -> Change | None:
    entry, other = row.entries[index], reference.entries[index]
    if columns[index].averages:
        by_name = dict(zip((column.name for column in columns), row.entries, strict=True))
        others = dict(zip((column.name for column in columns), reference.entries, strict=True))
        applying = [name for name in columns[index].averages if by_name[name].applies]
        other = _average([others[name] for name in applying])
    if entry.marks or other.marks or entry.percent is None or other.percent is None:
        return None
    return change(entry.percent, other.percent)


def with_best(rows: Sequence[Row]) -> list[Row]:
    """The rows with the best of each column in each group, ours and published each by themselves.

    Where all have the same rate (or only one has any), or one of them is incomplete, none is called
    the best.
    """
    return [
        replace(
            row,
            entries=tuple(
                replace(entry, best=_is_best(entry, _rivals(rows, row, index)))
                for index, entry in enumerate(row.entries)
            ),
        )
        for row in rows
    ]


def _rivals(rows: Sequence[Row], row: Row, index: int) -> list[Entry]:
    return [
        other.entries[index]
        for other in rows
        if (other.group, other.source) == (row.group, row.source)
    ]


def _is_best(entry: Entry, rivals: Sequence[Entry]) -> bool:
    rates = [rival.percent for rival in rivals if rival.percent is not None]
    fair = len(set(rates)) > 1 and not any(rival.marks for rival in rivals)
    return fair and entry.percent is not None and entry.percent == max(rates)
