"""The frame of stored runs, and its columns about words, which only whole records know."""

from __future__ import annotations

import functools
import itertools
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence

from roboirg.analysis.results.frame import (
    COLUMNS,
    Frame,
    FrameColumn,
    Spared,
    as_column,
    make_frame,
)
from roboirg.analysis.results.sources import Source
from roboirg.language.instruction import command_expressions
from roboirg.records.record import Job, Record
from roboirg.records.record_codec import identity_key
from roboirg.util.discovery import with_entries
from roboirg.util.freed_memory import paused_collection

SINGLED = "one of two"
"""Before the kind of words that single out one of two values."""

Texts = tuple[str, ...]


def _expressions(record: Record) -> Texts:
    """Return the classes of the referring expressions in the command, which is said last."""
    return command_expressions(record.mentions, len(record.instruction) - 1)


def _rival(record: Record) -> str | None:
    """Return how the words tell the right value from its rival; None without a rival."""
    reference = record.metadata.get("rival_reference")
    if reference is None:
        return None
    return f"{SINGLED}: {reference}"


_OURS = (
    FrameColumn(
        "pattern",
        "text",
        "main reasoning pattern",
        "no reasoning",
        lambda record: record.metadata.get("pattern"),
    ),
    FrameColumn(
        "expression",
        "texts",
        "classes of the command's referring expressions",
        "",
        _expressions,
    ),
    FrameColumn(
        "slots",
        "number",
        "values of the goal that the command leaves to its context",
        "none",
        lambda record: record.metadata.get("hidden_slots") or None,
    ),
    FrameColumn(
        "rival",
        "text",
        "how the words single out one of two values",
        "no rival",
        _rival,
    ),
    FrameColumn(
        "landmark",
        "texts",
        "landmarks in the words",
        "",
        lambda record: tuple(record.metadata.get("landmarks", ())),
    ),
    FrameColumn(
        "words",
        "number",
        "words of all utterances",
        "",
        lambda record: sum(len(turn.text.split()) for turn in record.instruction),
    ),
    FrameColumn(
        "command",
        "text",
        "the same task in explicit words",
        "",
        lambda record: record.command,
    ),
)


@functools.cache
def record_columns() -> Mapping[str, FrameColumn]:
    """Return the columns that are read from whole records, those of installed packages, too."""
    found = with_entries((*COLUMNS.values(), *_OURS), "COLUMN", FrameColumn, "roboirg.columns")
    return {name: column for name, column in found.items() if name not in COLUMNS}


@paused_collection()
def read_frame(sources: Sequence[Source], *, words: bool = False) -> Frame:
    """Return the results of runs as a table, with a row for each missing episode, too.

    Args:
        sources: the runs.
        words: whether to add columns on the words of instructions, for which the whole records are
            read.
    """
    frame = _frame_of(sources)
    if not words:
        return frame
    records = itertools.chain.from_iterable(source.records() for source in sources)
    return with_words(frame, records)


def _frame_of(sources: Sequence[Source]) -> Frame:
    """Return the results of runs as a table; that of a single run is made only once."""
    if len(sources) == 1:
        return sources[0].frame
    runs = []
    planned: list[Job] = []
    spared: dict[str, Spared] = {}
    for source in sources:
        parts = source.frame_parts
        name = str(source.path)
        runs.append((name, parts.results))
        planned += parts.planned
        spared |= parts.spared_of(name)
    return make_frame(runs, planned, spared=spared)


def with_words(frame: Frame, records: Iterable[Record]) -> Frame:
    """Return a frame with `record_columns`; see `with_columns`."""
    reads = {name: column.read for name, column in record_columns().items()}
    return with_columns(frame, records, reads)


def with_columns(
    frame: Frame, records: Iterable[Record], reads: Mapping[str, Callable[[Record], object]]
) -> Frame:
    """Return a frame of results with further columns, which are read from whole records.

    Args:
        frame: of results.
        records: of its runs, in any order; they are read one by one, and none is kept.
        reads: returns the value of a record, by the name of the column.
    """
    results = frame["result"]
    # A result and its record have the same key; several rows may have the same result.
    rows_by_play = defaultdict(list)
    for row, result in enumerate(results):
        rows_by_play[_play_key(result)].append(row)

    columns: dict[str, list[object]] = {}
    for name in reads:
        columns[name] = [None] * len(results)  # None if not played
    for record in records:
        rows = rows_by_play.get(_play_key(record))
        if rows is None:
            continue  # played again since, or of another policy
        for name, read in reads.items():
            value = read(record)
            for row in rows:
                columns[name][row] = value
    return frame.extended({name: as_column(values) for name, values in columns.items()})


def _play_key(job: Job) -> tuple[object, ...]:
    """Return what distinguishes the same episode in two runs, or played again in one.

    An episode that was not played has no time at which it began.
    """
    return identity_key(job), getattr(job, "started_at", None)
