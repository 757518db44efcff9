"""Tables before rendering: rows of entries with everything that a rendering shows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Literal, NamedTuple

from roboirg.evaluation.analysis.comparability import Differences, comparison_sign, merged
from roboirg.evaluation.analysis.stats.intervals import Interval
from roboirg.evaluation.analysis.stats.rates import change_text, mean_percent

Source = Literal["ours", "published", "cited", "chance"]
"""Origin of a row: the run, the paper's results, a citation of the paper, or computed."""

NOT_APPLICABLE = "–"
ERROR_MARK = "!"
MISSING_MARK = "…"
PARTIAL_MARK = "*"
CHECK_MARK = "✓"
PUBLISHED_MARK = " (published)"
POLICY = "policy"
"""Heading of policies, whose names are marked if their rows are published."""


class Counts(NamedTuple):
    """The counts behind an entry.

    Attributes:
        successes: trials that succeeded.
        trials: trials with a verdict.
        episodes: episodes with a verdict.
        errors: trials that ended in an error.
        missing: planned trials without a result.
        interval: 95 % interval of the rate, or None.
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
        percent: as printed; None if there is nothing to print.
        word: printed instead of a rate; empty in tables of rates.
        applies: False if the setting is not defined for the task.
        change: difference of the printed rate from the reference's; None without a reference or if
            either is incomplete.
        best: whether it is the best, or among the best, of its group.
        marks: of incomplete entries, as in the constants above.
        counts: behind the rate; None if they are unknown.
        differences: from the published rate's conditions; None without a published rate.
    """

    percent: Decimal | None = None
    word: str = ""
    applies: bool = True
    change: Decimal | None = None
    best: bool = False
    marks: str = ""
    counts: Counts | None = None
    differences: Differences | None = None

    @property
    def change_text(self) -> str:
        """The change with its arrow; empty without one."""
        return "" if self.change is None else change_text(self.change)

    @property
    def signs(self) -> str:
        """The marks, and whether the rate can be compared with the published one."""
        return self.marks + comparison_sign(self.differences)

    @property
    def text(self) -> str:
        """The rate, a dash if the setting does not apply, or the word; empty without results."""
        if self.word:
            return self.word
        if not self.applies:
            return NOT_APPLICABLE
        return "" if self.percent is None else str(self.percent)


class Column(NamedTuple):
    """A column of entries.

    Attributes:
        name: a task, or the name of an average.
        group: the suite, or empty.
        averages: the columns that an average is taken over; empty for a task.
        is_text: whether its entries are texts of any length, and not rates or counts.
    """

    name: str
    group: str = ""
    averages: tuple[str, ...] = ()
    is_text: bool = False


@dataclass(frozen=True, slots=True)
class Row:
    """A row of a table.

    Attributes:
        group: the setting or policy above it.
        name: of the row in its group.
        source: origin of its rates.
        entries: one for each column.
    """

    group: str
    name: str
    source: Source
    entries: tuple[Entry, ...]


@dataclass(frozen=True, slots=True)
class Table:
    """A table, ready to be rendered.

    Attributes:
        key: a short name, usable as a file name.
        title: of the table.
        heads: headings of the groups, and of the names of the rows. With several of these a name
            lists headings, and each has a check mark or none.
        columns: of the entries.
        rows: in groups.
        notes: sentences below the table.
        published_mark: behind the names of policies in published rows.
    """

    key: str
    title: str
    heads: tuple[str, ...]
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()
    published_mark: str = PUBLISHED_MARK

    def groups(self) -> dict[str, list[Row]]:
        """Return the rows by the label of their group, in order."""
        groups: dict[str, list[Row]] = {}
        for row in self.rows:
            label = row.group + self._mark(row, is_policy=self._is_by_policy)
            groups.setdefault(label, []).append(row)
        return groups

    def names(self, row: Row) -> tuple[str, ...]:
        """Return the label of a row, or its check marks, one for each heading of names."""
        heads = self.heads[1:]
        if len(heads) > 1:
            listed = row.name.split(",")
            return tuple(CHECK_MARK if head in listed else "" for head in heads)
        return (row.name + self._mark(row, is_policy=not self._is_by_policy),)

    @property
    def _is_by_policy(self) -> bool:
        return self.heads[0] == POLICY

    def _mark(self, row: Row, *, is_policy: bool) -> str:
        return self.published_mark if is_policy and row.source == "published" else ""


def with_averages(columns: Sequence[Column], entries: Mapping[str, Entry]) -> tuple[Entry, ...]:
    """Return a row's entries: those of its tasks, and the averages over them.

    An average is over the tasks that apply and have a rate. It is marked if one of them has no
    rate or is incomplete.
    """
    return tuple(
        _average([entries[name] for name in column.averages])
        if column.averages
        else entries[column.name]
        for column in columns
    )


def _average(entries: Sequence[Entry]) -> Entry:
    applying = [entry for entry in entries if entry.applies]
    if not applying:
        return Entry(applies=False)
    rates = [entry.percent for entry in applying if entry.percent is not None]
    if not rates:
        return Entry()
    is_partial = len(rates) < len(applying) or any(entry.marks for entry in applying)
    return Entry(
        percent=mean_percent(rates),
        marks=PARTIAL_MARK if is_partial else "",
        differences=merged(entry.differences for entry in applying),
    )


def with_changes(
    columns: Sequence[Column], rows: Iterable[Row], reference_of: Callable[[Row], Row | None]
) -> list[Row]:
    """Return the rows with the change of each entry compared with its reference.

    An average is compared with the reference's average over the same tasks, as some tasks lack
    some settings.
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


def _change(columns: Sequence[Column], index: int, row: Row, reference: Row) -> Decimal | None:
    entry, other = row.entries[index], reference.entries[index]
    if columns[index].averages:
        by_name = dict(zip((column.name for column in columns), row.entries, strict=True))
        others = dict(zip((column.name for column in columns), reference.entries, strict=True))
        applying = [name for name in columns[index].averages if by_name[name].applies]
        other = _average([others[name] for name in applying])
    if entry.marks or other.marks or entry.percent is None or other.percent is None:
        return None
    return entry.percent - other.percent


def with_best(rows: Sequence[Row]) -> list[Row]:
    """Return the rows with the best entries of each column, group and source marked.

    None is the best if all have the same rate, only one has a rate, or one is incomplete.
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
