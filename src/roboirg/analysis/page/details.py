"""What an opened episode shows: words with their mentions, time line, cause, film."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from roboirg.analysis.page.films import EpisodeVideo
from roboirg.analysis.page.reconstruction import resolved_form, stages_of
from roboirg.core.fact_traits import fact_traits
from roboirg.records.record import EventRecord, Record

INSIDE = "#"
"""Stands for a film that is part of the page."""

Details = dict[str, Any]


@dataclass
class Strings:
    """Every text once."""

    texts: list[str] = field(default_factory=list)
    _places: dict[str, int] = field(default_factory=dict)

    def index(self, text: str) -> int:
        """Where a text is; it is added if it is new."""
        place = self._places.setdefault(text, len(self.texts))
        if place == len(self.texts):
            self.texts.append(text)
        return place


def words_of(record: Record, strings: Strings) -> list[int]:
    """The texts that a search looks into: the utterances first, then what went wrong."""
    texts = [turn.text for turn in record.instruction]
    texts += [text for text in (record.cause, _sentence(record)) if text]
    return [strings.index(text) for text in texts]


def details_of(
    record: Record,
    strings: Strings,
    film: EpisodeVideo | None,
    resolved: str | None,
    *,
    embeds: bool,
) -> Details:
    """An episode, with texts as indices; what is empty is left out.

    Args:
        record: of the episode.
        strings: where the texts go.
        film: of it.
        resolved: its resolved form, if that was played too.
        embeds: whether the film is part of the page.
    """
    at = strings.index
    if resolved is None or record.form == "resolved":
        resolved = resolved_form(record)
    found: Details = {
        "turns": [[at(turn.stage), at(turn.text)] for turn in record.instruction],
        "mentions": [
            [one.utterance, one.start, one.end, int(one.role == "anaphor"),
             at(one.expression or ""), at(one.slot), at(str(one.value))]
            for one in record.mentions
        ],
        "command": None if record.setting == "explicit" else at(record.command),
        "resolved": None if resolved is None else at(resolved),
        "goal": [[at(slot), at(_value(value))] for slot, value in record.goal.items()],
        "cause": None if record.cause is None else at(record.cause),
        "attribution": _attribution(record, strings),
        "shown": record.demonstration_steps or None,
        "events": [[one.step, at(event_text(one)), int(one.holds)] for one in _told(record)],
        "stages": [[at(mark.subgoal), mark.step] for mark in stages_of(record)],
        "traceback": None if record.details is None else at(record.details),
        "lost": None if record.video_error is None else at(record.video_error),
        "rules": at(_rules(record)),
    }  # fmt: skip
    if film is not None:
        found["film"] = INSIDE if embeds else film.source
        found["poster"] = INSIDE if embeds else film.poster
    return {name: value for name, value in found.items() if value is not None and value != []}


def event_text(event: EventRecord) -> str:
    """An event in words."""
    names = (event.subject, fact_traits(event.kind).state, event.place)
    text = " ".join(name.replace("_", " ") for name in names if name)
    return text if event.holds else f"{text}: no longer"


def _told(record: Record) -> Iterator[EventRecord]:
    for event in record.events:
        shown = fact_traits(event.kind).timeline
        if shown == "both" or (shown == "start" and event.holds):
            yield event


def _attribution(record: Record, strings: Strings) -> list[Any] | None:
    found = record.attribution
    if found is None:
        return None
    return [strings.index(found.kind), strings.index(found.failure), found.step,
            strings.index(found.sentence)]  # fmt: skip


def _sentence(record: Record) -> str | None:
    return None if record.attribution is None else record.attribution.sentence


def _value(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def _rules(record: Record) -> str:
    words = [f"{record.split} split", f"at most {record.max_steps} steps"]
    words += [
        f"{name.replace('_', ' ')} {getattr(record, name)}"
        for name in ("actions", "demonstration_frames", "observe_every")
        if getattr(record, name) is not None
    ]
    versions = (
        f"policy {record.policy_version}, language {record.language_version}, environment "
        f"{record.environment_version}, roboirg {record.package_version}"
    )
    return f"{', '.join(words)}; {versions}"
