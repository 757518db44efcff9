"""Tables before they are printed: rows of entries with everything that a format shows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Literal, NamedTuple

from roboirg.evaluation.analysis.comparability import Differences, comparison_sign, merged
from roboirg.evaluation.analysis.stats.cells import Counts
from roboirg.evaluation.analysis.stats.intervals import Interval
from roboirg.evaluation.analysis.stats.rates import NOT_APPLICABLE, change_text, mean_percent

Source = Literal["ours", "published", "cited", "chance"]
"""Origin of a row: the run, the paper's results, a citation of the paper, or computed."""

ERROR_MARK = "!"
MISSING_MARK = "…"
PARTIAL_MARK = "*"
CHECK_MARK = "✓"
PUBLISHED_MARK = " (published)"
POLICY = "policy"
"""Heading of policies, whose names are marked if their rows are published."""


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
        interval: 95 %, of the rate; None if it is unknown.
        differences: from the published rate's conditions; None without a published rate.
        style: color of the text in a terminal, or empty.
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

    @property
    def text(self) -> str:
        """The rate, a dash if the setting does not apply, or the word; empty without results."""
        rate = "" if self.percent is None else str(self.percent)
        return self.word or (rate if self.applies else NOT_APPLICABLE)

    @property
    def change_text(self) -> str:
        """The change with its arrow; empty without one."""
        return "" if self.change is None else change_text(self.change)

    @property
    def signs(self) -> str:
        """The marks, and whether the rate can be compared with the published one."""
        return self.marks + comparison_sign(self.differences)

    def __str__(self) -> str:
        return " ".join(filter(None, (self.text, self.change_text, self.signs)))


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
    """

    group: str
    name: str
    cells: Sequence[Entry | str]
    source: Source = "ours"

    @property
    def entries(self) -> tuple[Entry, ...]:
        """The cells as entries."""
        return tuple(Entry(word=one) if isinstance(one, str) else one for one in self.cells)


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

    def lines(self) -> Iterator[tuple[bool, tuple[str, ...], Row]]:
        """Yield whether a row is the first of its group, its labels as printed, and the row."""
        for group in self.groups():
            for number, row in enumerate(group):
                labels = self.labels(row)
                names_group = not number or len(labels) == 1
                yield not number, labels if names_group else ("", *labels[1:]), row

    def groups(self) -> list[list[Row]]:
        """Return the rows of each group; published policies are apart from others of the name."""
        is_by_policy = self.heads[0] == POLICY
        return grouped(self.rows, lambda row: (row.group, is_by_policy and row.source))

    def labels(self, row: Row) -> tuple[str, ...]:
        """Return the label of a row below each head; names of published policies are marked."""
        names = [row.name]
        if len(self.heads) > 2:  # noqa: PLR2004 - a group and a name
            listed = row.name.split(",")
            names = [CHECK_MARK if head in listed else "" for head in self.heads[1:]]
        labels = [row.group, *names][-len(self.heads) :]
        if row.source == "published" and POLICY in self.heads:
            labels[self.heads.index(POLICY)] += PUBLISHED_MARK
        return tuple(labels)


def grouped(rows: Iterable[Row], key: Callable[[Row], object]) -> list[list[Row]]:
    """Return the rows of each key; groups are in the order of their first rows."""
    groups: dict[object, list[Row]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    return list(groups.values())


def average(entries: Sequence[Entry]) -> Entry:
    """Return the average over the tasks that apply and have a rate.

    It is marked if one of them has no rate or is incomplete.
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
    )


def with_averages(columns: Iterable[Column], entries: Mapping[str, Entry]) -> tuple[Entry, ...]:
    """Return a row's entries: those of its tasks, and the averages over them."""
    return tuple(
        average([entries[name] for name in column.averages])
        if column.averages
        else entries[column.name]
        for column in columns
    )


def with_changes(columns: Sequence[Column], rows: Iterable[tuple[Row, Row | None]]) -> list[Row]:
    """Return rows with the change of each entry compared with the reference next to it.

    An average is compared with the reference's average over the same tasks, as some tasks lack
    some settings.
    """
    return [
        row if reference is None else replace(row, cells=list(_changed(columns, row, reference)))
        for row, reference in rows
    ]


def _changed(columns: Sequence[Column], row: Row, reference: Row) -> Iterator[Entry]:
    names = [column.name for column in columns]
    ours, theirs = (dict(zip(names, one.entries, strict=True)) for one in (row, reference))
    for column, entry in zip(columns, row.entries, strict=True):
        tasks = column.averages or (column.name,)
        other = average([theirs[name] for name in tasks if ours[name].applies])
        if entry.marks or other.marks or entry.percent is None or other.percent is None:
            yield entry
        else:
            yield replace(entry, change=entry.percent - other.percent)


def with_best(rows: Iterable[Row]) -> Iterator[Row]:
    """Yield rows, those of a group together, with its best entries in each column marked.

    The sources are apart. None is the best if all have the same rate, only one has a rate, or one
    is incomplete.
    """
    for group in grouped(rows, lambda row: row.group):
        for rivals in grouped(group, lambda row: row.source):
            columns = zip(*(row.entries for row in rivals), strict=True)
            best = [_best(column) for column in columns]
            for row in rivals:
                entries = zip(row.entries, best, strict=True)
                cells = [replace(entry, best=entry.percent in rates) for entry, rates in entries]
                yield replace(row, cells=cells)


def _best(rivals: Sequence[Entry]) -> set[Decimal | None]:
    """Return the best rate, if there is one."""
    rates = {entry.percent for entry in rivals if entry.percent is not None}
    is_fair = len(rates) > 1 and not any(entry.marks for entry in rivals)
    return {max(rates)} if is_fair else set()
