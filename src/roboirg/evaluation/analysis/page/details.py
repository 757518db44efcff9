"""The details of an opened episode: instruction with mentions, timeline, cause, video.

Every text of the page is stored once. The details of an episode are a line of JSON with indices of
texts, which the page parses when the episode is opened.

A record leaves out what follows from it: the resolved form of its instruction, and when stages were
completed. Both are derived by the installed package, so only for records of the same versions; the
page omits them for others.
"""

from __future__ import annotations

import functools
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

import msgspec

from roboirg.core.conditions import Fact, facts_of
from roboirg.core.episode import ENVIRONMENT_VERSION, Episode, Scene, describe_goal
from roboirg.core.errors import RoboIRGError
from roboirg.core.fact_traits import fact_traits
from roboirg.core.plain_text import counted
from roboirg.core.word_pools import words_label
from roboirg.evaluation.analysis.page.episodes import JsonObject, PageEpisode
from roboirg.evaluation.play.job_instruction import instruct_job, other_versions
from roboirg.evaluation.records.record import EventRecord, Job, Record, SubgoalRecord
from roboirg.judging.episode_replay import Event, completed_stages
from roboirg.judging.judge import describe_object, plain_subgoal
from roboirg.language.arms import arm_episode
from roboirg.language.settings import EXPLICIT
from roboirg.tasks.splits.splits import get_episode

EMBEDDED = "#"
"""Stands for a video that is part of the page."""

_KINDS = {"shuttle": "the moving cube", "site": "the spot on the table"}
"""Words for objects that causes do not name."""


@dataclass
class EpisodeDetails:
    """Makes the details of one episode after the other.

    Attributes:
        folder: of the page; links lead from there.
        embeds: whether videos are part of the page.
        gone: folders that will not be there when the page is read, so that nothing links to them.
        links_videos: whether some are next to the page.
        strings: every text with its index, in order.
        words: for each episode, the texts that a search looks through.
        lines: for each episode, its details.
    """

    folder: Path
    embeds: bool
    gone: Sequence[Path] = ()
    links_videos: bool = False
    strings: dict[str, int] = field(default_factory=dict)
    words: list[list[int]] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)

    def add(self, episode: PageEpisode, record: Record) -> None:
        """Add an episode, given its whole record."""
        cause = record.attribution
        searched = [turn.text for turn in record.instruction]
        searched += [one for one in (record.cause, cause and cause.sentence) if one]
        self.words.append(list(map(self._index, searched)))
        details = self.details_of(record)
        media = {"film": episode.film, "poster": episode.poster}
        for name, path in {**media, "log": episode.log}.items():
            if path is not None and self.embeds and name in media:
                details[name] = EMBEDDED
            elif path is not None and not any(map(path.is_relative_to, self.gone)):
                details[name] = quote(Path(os.path.relpath(path, self.folder)).as_posix())
                self.links_videos |= name in media
        self.lines.append(msgspec.json.encode(details).decode())

    def details_of(self, record: Record) -> JsonObject:
        """Return the details of an episode, with texts as indices; empty ones are left out."""
        index = self._index
        # Of the job only what decides the words, which all policies and seeds share.
        job = Job(
            policy="", task=record.task, split=record.split, episode=record.episode,
            options=record.options, arm=record.arm, wordings_file=record.wordings_file,
        )  # fmt: skip
        foreign = other_versions(record)
        scene = _PlayedScene(None, {}, {})
        if record.environment_version == ENVIRONMENT_VERSION:
            scene = _played_scene(job.task, job.split, job.episode, job.arm)
        cause = record.attribution
        audit = record.prompt
        found: JsonObject = {
            "turns": [[index(turn.stage), index(turn.text)] for turn in record.instruction],
            "reached": audit.reached if audit and record.prompt_verdict == "cut" else None,
            "prompt": self._optional(_prompt(record)),
            "mentions": [
                [one.utterance, one.start, one.end, int(one.role == "anaphor"),
                 index(one.expression or ""), index(one.slot), index(str(one.value))]
                for one in record.mentions
            ],
            "command": None if record.setting == EXPLICIT else index(record.command),
            "resolved": self._optional(None if foreign else _resolved_form(job)),
            "goal": index(describe_goal(record.goal)),
            "slots": list(map(index, record.goal)),
            "named": self._optional(_named(record) if record.outcome == "failure" else None),
            "cause": self._optional(record.cause),
            "attribution": cause and [*map(index, (cause.kind, cause.failure)), cause.step,
                                      index(cause.sentence)],
            "shown": record.demonstration_steps or None,
            "events": [
                [one.step, index(act), int(one.holds)]
                for one in record.events if (act := scene.act(one)) is not None
            ],
            "subgoals": [
                [one.step, index(_subgoal_text(one)), int(one.verdict == "right")]
                for one in record.subgoals
            ],
            "stages": [[index(words), step] for words, step in scene.stages(record)],
            "traceback": self._optional(record.details),
            "lost": self._optional(record.video_error),
            "conditions": index(_conditions(record)),
        }  # fmt: skip
        return {name: value for name, value in found.items() if value is not None and value != []}

    def _index(self, text: str) -> int:
        """Return the index of a text, which is added if it is new."""
        return self.strings.setdefault(text, len(self.strings))

    def _optional(self, text: str | None) -> int | None:
        return None if text is None else self._index(text)


@functools.lru_cache(maxsize=65_536)
def _resolved_form(job: Job) -> str | None:
    """Return the same instruction with every reference resolved.

    None if it has this form already, or if its task or wording file is no longer there.
    """
    if job.setting == EXPLICIT or job.form == "resolved":
        return None
    try:
        return instruct_job(job.with_options(form="resolved")).text
    except RoboIRGError:
        return None


class _PlayedScene(NamedTuple):
    """What is the same whenever a scene is played.

    Attributes:
        episode: None for another environment version, or a task that is no longer installed.
        names: words for the objects.
        facts: those that stages depend on.
    """

    episode: Episode | None
    names: Mapping[str, str]
    facts: Mapping[Fact, Fact]

    def act(self, event: EventRecord) -> str | None:
        """Return an event in words; None if timelines do not show it."""
        shown = fact_traits(event.kind).timeline
        is_shown = shown == "both" or (shown == "start" and event.holds)
        return event_text(event, self.names) if is_shown else None

    def stages(self, record: Record) -> list[tuple[str, int | None]]:
        """Return the stages of the policy's turn: subgoals, and the steps that completed them."""
        if not record.events or self.episode is None:
            return []
        turn = max(0, -min(event.step for event in record.events))
        last = max(record.steps, *(event.step for event in record.events))
        events = [
            Event(one.step + turn, fact, one.holds)
            for one in record.events
            if (fact := self.facts.get(Fact(one.kind, one.subject, one.place))) is not None
        ]
        try:
            done = completed_stages(self.episode, events, turn + last)
        except KeyError:
            return []  # incomplete events
        return [
            (plain_subgoal(stage), done[place] - turn if place in done else None)
            for place, stage in enumerate(self.episode.stages)
        ]


@functools.lru_cache(maxsize=4096)
def _played_scene(task: str, split: str, number: int, arm: str) -> _PlayedScene:
    try:
        episode = arm_episode(get_episode(task, split, number), arm)
    except RoboIRGError:
        return _PlayedScene(None, {}, {})
    stages = (*episode.demonstration, *episode.stages)
    conditions = (one for stage in stages for one in (stage.expects, *stage.forbids))
    facts = {fact: fact for condition in conditions for fact in facts_of(condition)}
    return _PlayedScene(episode, _object_names(episode.scene), facts)


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


def _object_names(scene: Scene) -> Mapping[str, str]:
    """Return words for each object; where two have the same, the end of their names is added."""
    words = {
        one.name: _KINDS.get(one.kind) or describe_object(one.name, scene) for one in scene.objects
    }
    counts = Counter(words.values())
    return {
        name: text if counts[text] == 1 else f"{text} ({name.rpartition('_')[2]})"
        for name, text in words.items()
    }


def _subgoal_text(one: SubgoalRecord) -> str:
    parts = []
    if one.verdict != "right":
        parts += [one.verdict.replace("_", " "), f"due: {one.due or 'nothing'}"]
    if one.ended is not None and one.ended != "done":
        parts.append(f"{one.ended}: {one.why}" if one.why else one.ended)
    return f"{one.text} ({'; '.join(parts)})" if parts else one.text


def _named(record: Record) -> str | None:
    """Return the goal that a failed listener named, or the last subgoal before the failure.

    None if nothing was named, and if no model names anything.
    """
    goal = record.policy_metadata.get("understood")
    cause = record.attribution
    if isinstance(goal, dict):
        return describe_goal(goal)
    end = record.steps if cause is None or cause.step is None else cause.step
    said = [one for one in record.subgoals if one.step <= end]
    return f"“{said[-1].text}”; due was “{said[-1].due or 'nothing'}”" if said else None


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
    versions = (
        f"policy {record.played_version}, language {record.language_version}, environment "
        f"{record.environment_version}, roboirg {record.package_version}"
    )
    return f"{', '.join(parts)}; {versions}"
