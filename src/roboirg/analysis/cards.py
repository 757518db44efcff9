"""Episodes as the page shows them: words with their mentions, time line, film."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import NamedTuple
from urllib.parse import quote

from roboirg.analysis.statistics import Variant
from roboirg.evaluation.record import EventRecord, MentionSpan, Record

STEPS_PER_SECOND = 20
RESTING = "still"
MOST_FILM_BYTES = 60_000_000
"""Films that weigh more together stay beside the page."""
_HUES = 4
"""Colours that the style sheet has for slots."""
_NEUTRAL = "reference"
"""The colour of what only leads to the goal."""
_TICK_SECONDS = (1, 2, 5, 10, 20, 60)
_MOST_TICKS = 6


class Segment(NamedTuple):
    """A stretch of an utterance; `mention` is None between mentions."""

    text: str
    mention: MentionSpan | None
    hue: str
    hint: str


class Line(NamedTuple):
    """An utterance as it is shown."""

    stage: str
    segments: tuple[Segment, ...]


class Mark(NamedTuple):
    """An event on the time line; `left` is its place in per cent."""

    left: float
    step: int
    seconds: str
    text: str
    holds: bool


class Tick(NamedTuple):
    """A place on the scale of the time line."""

    left: float
    seconds: int


@dataclass(frozen=True, slots=True)
class Card:
    """An episode as it is shown. Films and pictures are data URIs, or paths beside the page."""

    number: int
    record: Record
    setting: str
    lines: tuple[Line, ...]
    goal: str
    marks: tuple[Mark, ...]
    ticks: tuple[Tick, ...]
    seconds: str
    video: str | None
    poster: str | None


@dataclass(frozen=True, slots=True)
class Media:
    """How films get into the page.

    Attributes:
        folder: of the run; None leaves films out.
        embeds: whether they become part of the page.
    """

    folder: Path | None
    embeds: bool

    @classmethod
    def of(cls, records: Sequence[Record], folder: Path | None) -> Media:
        """Into the page where they are not too much together."""
        if folder is None:
            return cls(None, embeds=True)
        films = [folder / record.video for record in records if record.video is not None]
        weight = sum(film.stat().st_size for film in films if film.is_file())
        return cls(folder, embeds=weight <= MOST_FILM_BYTES)

    def link(self, name: str | None, kind: str) -> str | None:
        """What a source attribute says; None without the file."""
        if self.folder is None or name is None:
            return None
        if self.embeds:
            return _data_uri(self.folder / name, kind)
        return quote(name) if (self.folder / name).is_file() else None


def make_card(number: int, record: Record, media: Media) -> Card:
    """The card of an episode, `number` of them all."""
    hues = {slot: str(index % _HUES) for index, slot in enumerate(record.goal)}
    poster = None if record.video is None else str(PurePosixPath(record.video).with_suffix(".jpg"))
    return Card(
        number=number,
        record=record,
        setting=Variant.of(record).label,
        lines=tuple(
            Line(turn.stage, _segments(turn.text, _mentions_of(record, index), hues))
            for index, turn in enumerate(record.instruction)
        ),
        goal=" · ".join(f"{slot}: {_value(value)}" for slot, value in record.goal.items()),
        marks=_marks(record),
        ticks=_ticks(record),
        seconds=f"{record.steps / STEPS_PER_SECOND:.0f}",
        video=media.link(record.video, "video/mp4"),
        poster=media.link(poster, "image/jpeg"),
    )


def _value(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def _mentions_of(record: Record, utterance: int) -> list[MentionSpan]:
    own = [mention for mention in record.mentions if mention.utterance == utterance]
    return sorted(own, key=lambda mention: mention.start)


def _segments(
    text: str, mentions: Sequence[MentionSpan], hues: dict[str, str]
) -> tuple[Segment, ...]:
    segments: list[Segment] = []
    position = 0
    for mention in mentions:
        if mention.start < position:
            # One span may stand for several values ("them"); it is drawn once and lists all.
            if segments and segments[-1].mention is not None:
                last = segments[-1]
                segments[-1] = last._replace(hint=f"{last.hint}, {mention.value}")
            continue
        if position < mention.start:
            segments.append(Segment(text[position : mention.start], None, "", ""))
        hint = f"{mention.role}: {mention.slot} {mention.value}"
        span = text[mention.start : mention.end]
        segments.append(Segment(span, mention, hues.get(mention.slot, _NEUTRAL), hint))
        position = mention.end
    if position < len(text):
        segments.append(Segment(text[position:], None, "", ""))
    return tuple(segments)


def _marks(record: Record) -> tuple[Mark, ...]:
    """What the policy did; not what the video shows, and not every rest of the robot."""
    shown = _shown_events(record)
    last = _last_step(record)
    return tuple(
        Mark(
            left=round(100 * event.step / last, 2),
            step=event.step,
            seconds=f"{event.step / STEPS_PER_SECOND:.1f}",
            text=_event_text(event),
            holds=event.holds,
        )
        for event in shown
    )


def _shown_events(record: Record) -> list[EventRecord]:
    return [event for event in record.events if event.step > 0 and event.kind != RESTING]


def _last_step(record: Record) -> int:
    return max([1, record.steps, *(event.step for event in _shown_events(record))])


def _ticks(record: Record) -> tuple[Tick, ...]:
    """Whole seconds on the time line, a handful of them."""
    length = _last_step(record) / STEPS_PER_SECOND
    fitting = (step for step in _TICK_SECONDS if length / step < _MOST_TICKS)
    every = next(fitting, _TICK_SECONDS[-1])
    return tuple(
        Tick(round(100 * seconds / length, 2), seconds)
        for seconds in range(0, int(length) + 1, every)
    )


def _event_text(event: EventRecord) -> str:
    words = event.kind.replace("_", " ")
    text = f"{event.subject.replace('_', ' ')} {words}"
    if event.place:
        text += f" on {event.place.replace('_', ' ')}"
    return text if event.holds else f"{text}: no longer"


def _data_uri(path: Path, kind: str) -> str | None:
    try:
        data = path.read_bytes()
    except OSError:
        return None
    return f"data:{kind};base64,{base64.b64encode(data).decode('ascii')}"
