"""The frame of stored runs, and its columns about words, which only whole records know."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence

from roboirg.evaluation.analysis.results.frame import Frame, FrameColumn, as_column, make_frame
from roboirg.evaluation.plan.sources import Source
from roboirg.evaluation.records.record import Job, Record
from roboirg.evaluation.records.record_codec import identity_key
from roboirg.language.instruction import command_expressions
from roboirg.util.freed_memory import paused_collection

RIVAL, NO_RIVAL = "recency rival", "no recency rival"
COMPETING = "competing distractor"
SINGLED = "one of two"
"""Before the kind of words that single out one of two values."""

Texts = tuple[str, ...]


def _expressions(record: Record) -> Texts:
    return command_expressions(record.mentions, len(record.instruction) - 1)


def _rival(record: Record) -> str | None:
    metadata = record.metadata
    if (reference := metadata.get("rival_reference")) is not None:
        return f"{SINGLED}: {reference}"
    if metadata.get("distractor") is None or "it" not in _expressions(record):
        return None
    if metadata["distractor"] == "competing":
        return COMPETING
    return NO_RIVAL if metadata.get("recency_rival") is None else RIVAL


WORD_COLUMNS: Mapping[str, FrameColumn] = {
    one.name: one
    for one in (
        FrameColumn(
            "pattern",
            "text",
            "main reasoning pattern",
            "no reasoning",
            lambda one: one.metadata.get("pattern"),
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
            lambda one: one.metadata.get("hidden_slots") or None,
        ),
        FrameColumn(
            "rival",
            "text",
            "what else “it” could mean, or how the words exclude it",
            "no “it”",
            _rival,
        ),
        FrameColumn(
            "landmark",
            "texts",
            "landmarks in the words",
            "",
            lambda one: tuple(one.metadata.get("landmarks", ())),
        ),
        FrameColumn(
            "words",
            "number",
            "words of all utterances",
            "",
            lambda one: sum(len(turn.text.split()) for turn in one.instruction),
        ),
        FrameColumn(
            "command", "text", "the same task in explicit words", "", lambda one: one.command
        ),
    )
}


@paused_collection()
def read_frame(sources: Sequence[Source], *, words: bool = False) -> Frame:
    """Return the results of runs and what is missing in them, with `WORD_COLUMNS` if wanted."""
    runs = [(str(one.path), one.results) for one in sources]
    frame = make_frame(runs, [job for one in sources for job in one.planned])
    if not words:
        return frame
    return with_words(frame, itertools.chain.from_iterable(one.records() for one in sources))


def with_words(frame: Frame, records: Iterable[Record]) -> Frame:
    """Return a frame with `WORD_COLUMNS`; see `with_columns`."""
    return with_columns(frame, records, {one.name: one.read for one in WORD_COLUMNS.values()})


def with_columns(
    frame: Frame, records: Iterable[Record], reads: Mapping[str, Callable[[Record], object]]
) -> Frame:
    """Return a frame of results with further columns, which are read from whole records.

    Args:
        frame: of results.
        records: of its runs, in any order; they are read one by one, and none is kept.
        reads: returns the value of a record, by the name of the column.
    """
    places: dict[object, list[int]] = {}
    for place, one in enumerate(frame["result"]):
        places.setdefault(_row_key(one), []).append(place)
    columns = {name: as_column([None] * len(frame["result"])) for name in reads}
    for record in records:
        if at := places.get(_row_key(record)):
            for name, read in reads.items():
                columns[name][at] = as_column([read(record)])
    return frame.extended(columns)


def _row_key(job: Job) -> tuple[object, ...]:
    """Tell apart the same episode in two runs, or played again in one."""
    return identity_key(job), getattr(job, "started_at", None)
