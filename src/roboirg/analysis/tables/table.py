"""Tables before they are printed: rows of entries with everything that a format shows."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Literal, NamedTuple

from roboirg.analysis.comparability import Differences, comparison_sign, merged
from roboirg.stats.cells import Counts
from roboirg.stats.intervals import Interval
from roboirg.stats.rates import NOT_APPLICABLE, change_text, mean_percent

Source = Literal["ours", "published", "cited", "chance"]
"""Origin of a row: the run, the paper's results, a citation of the paper, or computed."""

ERROR_MARK = "!"
MISSING_MARK = "…"
SPARED_MARK = "‡"
PARTIAL_MARK = "*"
MARK_NAMES = {
    ERROR_MARK: "errors",
    MISSING_MARK: "missing",
    SPARED_MARK: "until decided",
    PARTIAL_MARK: "partial",
}
"""Why a rate is incomplete, by the mark behind it."""
CHECK_MARK = "✓"
PUBLISHED_MARK = " (published)"
POLICY = "policy"
"""Heading of policies, whose names are marked if their rows are published."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One cell of a table.

    Attributes:
        percent: the rate as printed; None without one.
        word: printed instead of a rate; empty in tables of rates.
        applies: False if the setting is not defined for the task.
        change: difference of the printed rate from the reference's; None without a reference or if
            either is incomplete.
        best: whether it is the best, or among the best, of its group.
        marks: why the rate is incomplete, as keys of `MARK_NAMES` one after the other.
        counts: behind the rate; None if they are unknown.
        interval: 95 %, of the rate; None if it is unknown.
        differences: from the published rate's conditions; None without a published rate.
        style: color of the text in a terminal, or empty.
        episodes: which ones the rate is of, in any form that differs for others; None if unknown.
    """

    percent: Decimal | None = None
    word: str = ""
    applies: bool = True
    change: Decimal | None = None
    best: bool = False
    marks: str = ""
    counts: Counts | None = None
    interval: Interval | None = None
    differences: Differences | None = None
    style: str = ""
    episodes: Hashable = None

    @property
    def text(self) -> str:
        """What is printed: the word if there is one, else the rate in percent, else nothing.

        It is a dash if the task does not have the setting.
        """
        if self.word:
            return self.word
        if not self.applies:
            return NOT_APPLICABLE
        return "" if self.percent is None else str(self.percent)

    @property
    def change_text(self) -> str:
        """The change with its arrow; empty without one."""
        return "" if self.change is None else change_text(self.change)

    @property
    def signs(self) -> str:
        """The marks, and whether the rate can be compared with the published one."""
        return self.marks + comparison_sign(self.differences)

    def __str__(self) -> str:
        parts = (self.text, self.change_text, self.signs)
        return " ".join(part for part in parts if part)


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


def named_columns(*names: str) -> tuple[Column, ...]:
    return tuple(map(Column, names))


@dataclass(frozen=True)
class Row:
    """A row of a table.

    Attributes:
        group: the setting or policy above it.
        name: of the row in its group.
        cells: one for each column, as an entry or as its word.
        source: origin of its rates.
        conditions: what must be equal in rows that are compared, such as the split; None if nothing
            is known to differ.
    """

    group: str
    name: str
    cells: Sequence[Entry | str]
    source: Source = "ours"
    conditions: Hashable = None

    @property
    def position(self) -> tuple[str, str, Source]:
        """What no other row of a table has: its group and name, and the origin of its rates."""
        return self.group, self.name, self.source

    @property
    def entries(self) -> tuple[Entry, ...]:
        """The cells as entries."""
        return tuple(Entry(word=cell) if isinstance(cell, str) else cell for cell in self.cells)


class PrintedRow(NamedTuple):
    """A row as it is printed.

    Attributes:
        begins_group: whether it is the first row of its group.
        labels: below each head; with several heads, only the first row of a group names the group.
        row: with the entries.
    """

    begins_group: bool
    labels: tuple[str, ...]
    row: Row


@dataclass(frozen=True, slots=True)
class Table:
    """A table, ready to be printed.

    Attributes:
        key: a short name, usable as a file name.
        title: of the table.
        heads: headings of the groups, and of the names of the rows. With several of these a name
            lists headings, and each has a check mark or none. With a single head in all, groups
            are set apart and not named.
        columns: of the entries.
        rows: printed by group, these in the order of their first rows.
        notes: sentences below the table.
    """

    key: str
    title: str
    heads: tuple[str, ...]
    columns: Sequence[Column]
    rows: Sequence[Row]
    notes: Sequence[str] = ()

    @property
    def headings(self) -> tuple[str, ...]:
        """The headings of all columns, those of the labels first."""
        return (*self.heads, *(column.name for column in self.columns))

    def lines(self) -> Iterator[PrintedRow]:
        """Yield the rows with their labels, group by group; the first row alone names the group."""
        for group in self.groups():
            for row in group:
                begins_group = row is group[0]
                labels = self.labels(row)
                if len(labels) > 1 and not begins_group:
                    labels = ("", *labels[1:])
                yield PrintedRow(begins_group, labels, row)

    def groups(self) -> list[list[Row]]:
        """Return the rows of each group; published policies are apart from others of the name."""
        if self.heads[0] == POLICY:
            return grouped(self.rows, lambda row: (row.group, row.source))
        return grouped(self.rows, lambda row: row.group)

    def labels(self, row: Row) -> tuple[str, ...]:
        """Return what the first columns of a row print, one text for each of the table's `heads`.

        With the heads ``setting`` and ``policy`` these are the row's group and its name; with the
        head ``task`` alone, its name. With the heads ``policy``, ``1``, ``3`` and ``5``, a row of
        pi0 that is named ``1,5`` has ``("pi0", "✓", "", "✓")``. Published policies are marked.
        """
        _, *name_heads = self.heads
        if not name_heads:
            labels = [row.name]
        elif len(name_heads) == 1:
            labels = [row.group, row.name]
        else:
            labels = [row.group]
            listed = row.name.split(",")
            for head in name_heads:
                labels.append(CHECK_MARK if head in listed else "")
        if row.source == "published" and POLICY in self.heads:
            labels[self.heads.index(POLICY)] += PUBLISHED_MARK
        return tuple(labels)


def grouped(rows: Iterable[Row], key: Callable[[Row], object]) -> list[list[Row]]:
    """Return the rows of each key; groups are in the order of their first rows."""
    groups = defaultdict(list)
    for row in rows:
        groups[key(row)].append(row)
    return list(groups.values())


def average(entries: Sequence[Entry]) -> Entry:
    """Return the entry for the average of several tasks' rates, as printed; empty without rates.

    It is marked as partial if a task has no rate or an incomplete one. Tasks for which the setting
    is not defined do not count.
    """
    applying = [entry for entry in entries if entry.applies]
    rates = [entry.percent for entry in applying if entry.percent is not None]
    if not rates:
        return Entry(applies=bool(applying))
    is_partial = len(rates) < len(applying) or any(entry.marks for entry in applying)
    return Entry(
        percent=mean_percent(rates),
        marks=PARTIAL_MARK if is_partial else "",
        differences=merged(entry.differences for entry in applying),
        episodes=tuple(entry.episodes for entry in applying),
    )


def with_averages(columns: Iterable[Column], entries: Mapping[str, Entry]) -> tuple[Entry, ...]:
    """Return a row's entries, one for each column: the rate of a task, or an average of rates.

    Args:
        columns: of the table; some are averages over tasks.
        entries: the rates by task.
    """
    row = []
    for column in columns:
        if column.averages:
            entry = average([entries[task] for task in column.averages])
        else:
            entry = entries[column.name]
        row.append(entry)
    return tuple(row)


def with_changes(columns: Sequence[Column], row: Row, reference: Row) -> Row:
    """Return a row whose entries have their changes from a reference row, such as explicit's.

    An average is compared with the reference's average over the same tasks, because some tasks
    lack the row's setting.
    """
    names = [column.name for column in columns]
    entries = dict(zip(names, row.entries, strict=True))
    reference_entries = dict(zip(names, reference.entries, strict=True))
    cells = []
    for column in columns:
        comparable = []
        # A column that is no average is a task.
        for task in column.averages or [column.name]:
            if entries[task].applies:
                comparable.append(reference_entries[task])
        # The average of a single entry is that entry.
        cells.append(_with_change(entries[column.name], average(comparable)))
    return replace(row, cells=cells)


def _with_change(entry: Entry, reference: Entry) -> Entry:
    """Return an entry with its change from a reference, unless either is incomplete."""
    if entry.marks or reference.marks or entry.percent is None or reference.percent is None:
        return entry
    return replace(entry, change=entry.percent - reference.percent)


def with_best(rows: Iterable[Row]) -> Iterator[Row]:
    """Yield rows, group by group, with the best entry of the group marked in each column.

    Only rows of the same source and conditions compete, such as published policies with published
    ones. None is the best if all have the same rate, only one has a rate, one is incomplete, or
    they are of different episodes.
    """
    for group in grouped(rows, lambda row: row.group):
        for rivals in grouped(group, lambda row: (row.source, row.conditions)):
            columns = zip(*(row.entries for row in rivals), strict=True)
            best_rates = list(map(_best_rate, columns))
            for row in rivals:
                cells = []
                for entry, best_rate in zip(row.entries, best_rates, strict=True):
                    is_best = best_rate is not None and entry.percent == best_rate
                    cells.append(replace(entry, best=is_best))
                yield replace(row, cells=cells)


def _best_rate(rivals: Sequence[Entry]) -> Decimal | None:
    """Return the best of several rates; None if they are equal, or cannot be compared."""
    rates = set()
    episodes = set()
    for entry in rivals:
        if entry.marks:
            return None
        if entry.percent is not None:
            rates.add(entry.percent)
            episodes.add(entry.episodes)
    if len(rates) <= 1 or len(episodes) > 1:
        return None
    return max(rates)
