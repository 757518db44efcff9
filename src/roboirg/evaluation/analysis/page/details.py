"""The details of an opened episode: instruction with mentions, timeline, cause, video."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from roboirg.core.fact_traits import fact_traits
from roboirg.core.plain_text import counted
from roboirg.evaluation.analysis.page.episode_videos import EpisodeVideo
from roboirg.evaluation.analysis.page.reconstruction import names_of, stages_of
from roboirg.evaluation.analysis.stats.option_labels import words_label
from roboirg.evaluation.records.record import EventRecord, Record, SubgoalRecord
from roboirg.language.settings import EXPLICIT

EMBEDDED = "#"
"""Stands for a video that is part of the page."""

Details = dict[str, Any]


@dataclass
class Strings:
    """A list of distinct texts."""

    texts: list[str] = field(default_factory=list)
    _places: dict[str, int] = field(default_factory=dict)

    def index(self, text: str) -> int:
        """Return the index of a text, which is added if it is new."""
        place = self._places.setdefault(text, len(self.texts))
        if place == len(self.texts):
            self.texts.append(text)
        return place

    def optional_index(self, text: str | None) -> int | None:
        return None if text is None else self.index(text)


def searched_texts(record: Record, strings: Strings) -> list[int]:
    """Return the texts that a search looks through: utterances, cause, attribution."""
    texts = [turn.text for turn in record.instruction]
    sentence = None if record.attribution is None else record.attribution.sentence
    texts += [text for text in (record.cause, sentence) if text]
    return [strings.index(text) for text in texts]


def details_of(
    record: Record,
    strings: Strings,
    video: EpisodeVideo | None,
    resolved: str | None,
    *,
    embeds: bool,
) -> Details:
    """Return the details of an episode, with texts as indices; empty ones are left out.

    `resolved` is the resolved form of its instruction; None if it has that form or none. If
    `embeds`, the video is part of the page.
    """
    index, optional_index = strings.index, strings.optional_index
    names = names_of(record)
    found: Details = {
        "turns": [[index(turn.stage), index(turn.text)] for turn in record.instruction],
        "reached": _reached(record),
        "prompt": optional_index(_prompt(record)),
        "mentions": _mentions(record, strings),
        "command": None if record.setting == EXPLICIT else index(record.command),
        "resolved": optional_index(resolved),
        "goal": [[index(slot), index(_value(value))] for slot, value in record.goal.items()],
        "cause": optional_index(record.cause),
        "attribution": _attribution(record, strings),
        "shown": record.demonstration_steps or None,
        "events": [
            [one.step, index(event_text(one, names)), int(one.holds)]
            for one in _shown_events(record)
        ],
        "subgoals": [
            [one.step, index(_subgoal_text(one)), int(one.verdict == "right")]
            for one in record.subgoals
        ],
        "stages": [[index(mark.subgoal), mark.step] for mark in stages_of(record)],
        "traceback": optional_index(record.details),
        "lost": optional_index(record.video_error),
        "conditions": index(_conditions(record)),
    }
    if video is not None:
        found["film"] = EMBEDDED if embeds else video.source
        found["poster"] = EMBEDDED if embeds else video.poster
    return {name: value for name, value in found.items() if value is not None and value != []}


def event_text(event: EventRecord, names: Mapping[str, str]) -> str:
    """Return an event as what was done, in the past tense.

    `names` has words for the objects; others are called by their names.
    """
    traits = fact_traits(event.kind)
    subject, place = (
        names.get(name, name.replace("_", " ")) for name in (event.subject, event.place or "")
    )
    if not event.holds and not traits.ceased:
        return f"{traits.past.format(subject=subject, place=place)}; this no longer holds"
    words = traits.past if event.holds else traits.ceased
    return words.format(subject=subject, place=place)


def _subgoal_text(one: SubgoalRecord) -> str:
    parts = []
    if one.verdict != "right":
        parts += [one.verdict.replace("_", " "), f"due: {one.due or 'nothing'}"]
    if one.ended is not None and one.ended != "done":
        parts.append(f"{one.ended}: {one.why}" if one.why else one.ended)
    return f"{one.text} ({'; '.join(parts)})" if parts else one.text


def _mentions(record: Record, strings: Strings) -> list[list[int]]:
    index = strings.index
    return [
        [one.utterance, one.start, one.end, int(one.role == "anaphor"),
         index(one.expression or ""), index(one.slot), index(str(one.value))]
        for one in record.mentions
    ]  # fmt: skip


def _reached(record: Record) -> list[int] | None:
    """Return the characters of each utterance that arrive, if some do not."""
    audit = record.prompt
    if audit is None or record.prompt_verdict != "cut":
        return None
    return list(audit.reached)


def _prompt(record: Record) -> str | None:
    """Return how many tokens the model reads, unless it read everything."""
    audit = record.prompt
    if audit is None or record.prompt_verdict == "heard":
        return None
    counted_by = f"counted with {audit.tokenizer}" if audit.tokenizer else "bounds, no tokenizer"
    lost = sum(record.mentions[place].role == "anaphor" for place in audit.lost)
    tail = ""
    if audit.lost:
        tail = f"; {counted(len(audit.lost), 'mention')} lost, {lost} of them referring back"
    verdict = "cut" if record.prompt_verdict == "cut" else "may be cut"
    return (
        f"{verdict}: needs {audit.needed_text} tokens, the model reads {audit.limit} "
        f"({counted_by}){tail}"
    )


def _shown_events(record: Record) -> Iterator[EventRecord]:
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


def _value(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def _conditions(record: Record) -> str:
    parts = [
        f"{record.split} split",
        f"at most {record.environment.max_steps} steps",
        f"in {words_label(record.options.wordings)}",
    ]
    parts += [
        f"{name.replace('_', ' ')} {value}"
        for name in ("actions", "demonstration_frames", "observe_every")
        if (value := getattr(record.environment, name)) is not None
    ]
    server = "" if record.server_version is None else f" (server {record.server_version})"
    versions = (
        f"policy {record.policy_version}{server}, language {record.language_version}, environment "
        f"{record.environment_version}, roboirg {record.package_version}"
    )
    return f"{', '.join(parts)}; {versions}"
