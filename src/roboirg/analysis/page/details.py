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

from roboirg.analysis.page.episodes import JsonObject, PageEpisode
from roboirg.core.conditions import Fact, facts_of
from roboirg.core.episode import ENVIRONMENT_VERSION, Episode, Scene, describe_goal
from roboirg.core.errors import RoboIRGError
from roboirg.core.fact_traits import fact_traits
from roboirg.core.plain_text import counted
from roboirg.core.word_pools import words_label
from roboirg.judging.episode_replay import Event, completed_stages
from roboirg.judging.judge import describe_object, plain_subgoal
from roboirg.language.arms import arm_episode
from roboirg.language.settings import EXPLICIT
from roboirg.records.record import (
    Attribution,
    EventRecord,
    Job,
    MentionSpan,
    Record,
    SubgoalRecord,
)
from roboirg.runs.job_instruction import instruct_job, other_versions
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
        temporary: folders that are deleted before the page is read, so that nothing links to them.
        links_videos: whether some are next to the page.
        strings: every text with its index, in order.
        words: for each episode, the texts that a search looks through.
        lines: for each episode, its details.
    """

    folder: Path
    embeds: bool
    temporary: Sequence[Path] = ()
    links_videos: bool = False
    strings: dict[str, int] = field(default_factory=dict)
    words: list[list[int]] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)

    def add(self, episode: PageEpisode, record: Record) -> None:
        """Add an episode: the texts in which a search looks, and its details as a line of JSON.

        Details include links to its video and log file, or a mark that the page holds the video.

        Args:
            episode: with the paths of its files.
            record: its whole record.
        """
        self.words.append(list(map(self._index, _searched_texts(record))))
        details = self.details_of(record)
        paths = {"film": episode.film, "poster": episode.poster, "log": episode.log}
        for name, path in paths.items():
            if path is None:
                continue
            is_media = name != "log"
            if is_media and self.embeds:
                details[name] = EMBEDDED
                continue
            is_temporary = any(path.is_relative_to(folder) for folder in self.temporary)
            if not is_temporary:
                details[name] = quote(Path(os.path.relpath(path, self.folder)).as_posix())
                self.links_videos |= is_media
        self.lines.append(msgspec.json.encode(details).decode())

    def details_of(self, record: Record) -> JsonObject:
        """Return the details of an episode, with texts as indices; empty ones are left out."""
        # In this order, in which texts get their indices.
        details = {
            **self._of_instruction(record),
            **self._of_outcome(record),
            **self._of_course(record),
            "traceback": self._optional(record.details),
            "lost": self._optional(record.video_error),
            "conditions": self._index(_conditions(record)),
        }
        return {name: value for name, value in details.items() if value not in (None, [])}

    def _of_instruction(self, record: Record) -> JsonObject:
        """Return what a policy was asked to do: the turns, what their words mean, what was cut.

        Texts are given by their index among those of the page.
        """
        audit = record.prompt
        reached = None
        if audit is not None and record.prompt_verdict == "cut":
            reached = audit.reached
        turns = []
        for turn in record.instruction:
            turns.append([self._index(turn.stage), self._index(turn.text)])
        return {
            "turns": turns,
            "reached": reached,
            "prompt": self._optional(_prompt(record)),
            "mentions": list(map(self._mention, record.mentions)),
            "command": None if record.setting == EXPLICIT else self._index(record.command),
            "resolved": self._optional(_resolved_words(record)),
        }

    def _mention(self, mention: MentionSpan) -> list[int]:
        """Return where a mention stands, whether it refers back, and what it stands for."""
        return [
            mention.utterance,
            mention.start,
            mention.end,
            int(mention.role == "anaphor"),
            self._index(mention.expression or ""),
            self._index(mention.slot),
            self._index(str(mention.value)),
        ]

    def _of_outcome(self, record: Record) -> JsonObject:
        """Return the goal, and why it was not reached."""
        has_failed = record.outcome == "failure"
        return {
            "goal": self._index(describe_goal(record.goal)),
            "slots": list(map(self._index, record.goal)),
            "named": self._optional(_goal_as_understood(record)) if has_failed else None,
            "cause": self._optional(record.cause),
            "attribution": self._attribution(record.attribution),
        }

    def _attribution(self, attribution: Attribution | None) -> list[int | None] | None:
        """Return kind, name, step and sentence of a failure."""
        if attribution is None:
            return None
        return [
            self._index(attribution.kind),
            self._index(attribution.failure),
            attribution.step,
            self._index(attribution.sentence),
        ]

    def _of_course(self, record: Record) -> JsonObject:
        """Return what happened, by control steps: events, a planner's subgoals, stages of the task.

        Texts are given by their index among those of the page.
        """
        # The installed package knows the stages of its own environment version only.
        scene = _UNKNOWN_SCENE
        if record.environment_version == ENVIRONMENT_VERSION:
            scene = _played_scene(record.task, record.split, record.episode, record.arm)
        events = []
        for event in record.events:
            act = scene.act(event)
            if act is not None:
                events.append([event.step, self._index(act), int(event.holds)])
        subgoals = []
        for subgoal in record.subgoals:
            is_right = int(subgoal.verdict == "right")
            subgoals.append([subgoal.step, self._index(_subgoal_text(subgoal)), is_right])
        return {
            "shown": record.demonstration_steps or None,
            "events": events,
            "subgoals": subgoals,
            "stages": [[self._index(words), step] for words, step in scene.stages(record)],
        }

    def _index(self, text: str) -> int:
        """Return the index of a text, which is added if it is new."""
        return self.strings.setdefault(text, len(self.strings))

    def _optional(self, text: str | None) -> int | None:
        """Return the index of a text, if there is one."""
        return None if text is None else self._index(text)


def _searched_texts(record: Record) -> list[str]:
    """Return the texts of an episode in which the page searches: instruction, cause of failure."""
    texts = [turn.text for turn in record.instruction]
    if record.cause:
        texts.append(record.cause)
    if record.attribution is not None and record.attribution.sentence:
        texts.append(record.attribution.sentence)
    return texts


def _resolved_words(record: Record) -> str | None:
    """Return the instruction of an episode with every reference replaced by what it means.

    None if it has no reference, or if it is of another version, whose words the installed package
    does not have.
    """
    if other_versions(record):
        return None
    # Without policy and seed, so that all policies share a job, whose words are made only once.
    job = Job(
        policy="",
        task=record.task,
        split=record.split,
        episode=record.episode,
        options=record.options,
        arm=record.arm,
        wordings_file=record.wordings_file,
    )
    return _resolved_form(job)


@functools.lru_cache(maxsize=65_536)
def _resolved_form(job: Job) -> str | None:
    """Return the instruction of a job with every reference replaced by what it means.

    None if the instruction has no reference, or if its task or wording file is no longer installed.
    """
    if job.setting == EXPLICIT or job.form == "resolved":
        return None
    try:
        return instruct_job(job.with_options(form="resolved")).text
    except RoboIRGError:
        return None


class _PlayedStage(NamedTuple):
    """A stage in words, and the step that completed it; None if none did."""

    subgoal: str
    step: int | None


@dataclass(frozen=True)
class _PlayedScene:
    """What is the same whenever a scene is played.

    Attributes:
        episode: None for another environment version, or a task that is no longer installed.
        names: words for the objects.
        facts: those that stages depend on, as stages have them.
        acts: events in words, as `act` returns them, which it has made so far.
    """

    episode: Episode | None
    names: Mapping[str, str]
    facts: Mapping[tuple[str, str, str | None], Fact]
    acts: dict[tuple[object, ...], str | None] = field(default_factory=dict)

    def act(self, event: EventRecord) -> str | None:
        """Return an event in words: ``picked up the red cube``; None if timelines do not show it.

        The same events occur whenever the scene is played, so their words are made once.
        """
        key = (event.kind, event.subject, event.place, event.holds)
        if key not in self.acts:
            shown = fact_traits(event.kind).timeline
            is_shown = shown == "both" or (shown == "start" and event.holds)
            self.acts[key] = event_text(event, self.names) if is_shown else None
        return self.acts[key]

    def stages(self, record: Record) -> list[_PlayedStage]:
        """Return the stages of the task, each with the control step at which it was completed.

        Steps count from the policy's turn; while a video is shown before it, they are negative.
        `completed_stages` counts from 0, so the length of the video is added, and subtracted again.
        """
        if not record.events or self.episode is None:
            return []
        steps = [event.step for event in record.events]
        video_steps = max(0, -min(steps))
        end = video_steps + max(record.steps, *steps)
        try:
            completed = completed_stages(self.episode, self._events(record, video_steps), end)
        except KeyError:
            return []  # incomplete events
        stages = []
        for number, stage in enumerate(self.episode.stages):
            step = completed.get(number)
            if step is not None:
                step -= video_steps
            stages.append(_PlayedStage(plain_subgoal(stage), step))
        return stages

    def _events(self, record: Record, video_steps: int) -> list[Event]:
        """Return the events of facts that stages depend on, with steps from the video's start."""
        events = []
        for event in record.events:
            fact = self.facts.get((event.kind, event.subject, event.place))
            if fact is not None:
                events.append(Event(event.step + video_steps, fact, event.holds))
        return events


_UNKNOWN_SCENE = _PlayedScene(None, {}, {})


@functools.lru_cache(maxsize=4096)
def _played_scene(task: str, split: str, number: int, arm: str) -> _PlayedScene:
    """Return the scene in which an episode was played, with words for its objects.

    Its facts are those that matter to the task: what its stages expect or forbid. An unknown scene
    without facts if the task is no longer installed.
    """
    try:
        episode = arm_episode(get_episode(task, split, number), arm)
    except RoboIRGError:
        return _UNKNOWN_SCENE
    facts: dict[tuple[str, str, str | None], Fact] = {}
    for stage in (*episode.demonstration, *episode.stages):
        for condition in (stage.expects, *stage.forbids):
            for fact in facts_of(condition):
                facts[fact] = fact
    return _PlayedScene(episode, _object_names(episode.scene), facts)


def event_text(event: EventRecord, names: Mapping[str, str]) -> str:
    """Return an event as what was done, in the past tense: ``picked up the red cube``.

    Args:
        event: the beginning or the end of a fact, such as *the robot holds the cube*.
        names: words for the objects; others are called by their names.
    """
    traits = fact_traits(event.kind)
    place_name = event.place or ""
    subject = names.get(event.subject, event.subject.replace("_", " "))
    place = names.get(place_name, place_name.replace("_", " "))
    begun = traits.past.format(subject=subject, place=place)
    if event.holds:
        return begun
    if not traits.ceased:
        return f"{begun}; this no longer holds"
    return traits.ceased.format(subject=subject, place=place)


def _object_names(scene: Scene) -> Mapping[str, str]:
    """Return words for each object, such as ``the red cube`` for ``cube_2``.

    Where two have the same words, the end of their names is added: ``the red cube (2)``.
    """
    names = {}
    for item in scene.objects:
        names[item.name] = _KINDS.get(item.kind) or describe_object(item.name, scene)
    counts = Counter(names.values())
    for name, words in names.items():
        if counts[words] > 1:
            _, _, end = name.rpartition("_")
            names[name] = f"{words} ({end})"
    return names


def _subgoal_text(subgoal: SubgoalRecord) -> str:
    """Return a planner's subgoal and, in brackets, what was wrong with it and how it ended.

    For example ``pick up the red cube (wrong thing; due: pick up the blue cube)``.
    """
    parts = []
    if subgoal.verdict != "right":
        parts.append(subgoal.verdict.replace("_", " "))
        parts.append(f"due: {subgoal.due or 'nothing'}")
    if subgoal.ended not in (None, "done"):
        ended = subgoal.ended
        if subgoal.why:
            ended += f": {subgoal.why}"
        parts.append(ended)
    if not parts:
        return subgoal.text
    return f"{subgoal.text} ({'; '.join(parts)})"


def _goal_as_understood(record: Record) -> str | None:
    """Return what a policy that failed took for the goal.

    That is the goal that a listener reports, or else a planner's last subgoal before the failure:
    ``“pick up the red cube”; due was “pick up the blue cube”``. None for other policies.
    """
    goal = record.policy_metadata.get("understood")
    if isinstance(goal, dict):
        return describe_goal(goal)
    failed_at = record.steps
    if record.attribution is not None and record.attribution.step is not None:
        failed_at = record.attribution.step
    subgoals = [subgoal for subgoal in record.subgoals if subgoal.step <= failed_at]
    if not subgoals:
        return None
    last = subgoals[-1]
    return f"“{last.text}”; due was “{last.due or 'nothing'}”"


def _prompt(record: Record) -> str | None:
    """Return how much of the prompt the policy's model did not read; None if it read everything.

    For example ``cut: needs 80 tokens, the model reads 48 (counted with gemma); 2 mentions lost, 1
    of them referring back``.
    """
    audit = record.prompt
    if audit is None or record.prompt_verdict == "heard":
        return None
    counted_by = "bounds, no tokenizer"
    if audit.tokenizer:
        counted_by = f"counted with {audit.tokenizer}"
    verdict = "cut" if record.prompt_verdict == "cut" else "may be cut"
    needed = audit.needed_text
    text = f"{verdict}: needs {needed} tokens, the model reads {audit.limit} ({counted_by})"
    if audit.lost:
        # Expressions that refer back, such as *it*; `lost` has numbers of the mentions not read.
        anaphors = sum(record.mentions[place].role == "anaphor" for place in audit.lost)
        mentions = counted(len(audit.lost), "mention")
        text += f"; {mentions} lost, {anaphors} of them referring back"
    return text


def _conditions(record: Record) -> str:
    """Return the conditions and versions of an episode as a phrase.

    For example ``test split, at most 1300 steps, in own words; policy 2, language 5, …``.
    """
    environment = record.environment
    parts = [
        f"{record.split} split",
        f"at most {environment.max_steps} steps",
        f"in {words_label(record.options.wordings)}",
    ]
    for name in ("actions", "demonstration_frames", "observe_every"):
        value = getattr(environment, name)
        if value is not None:
            parts.append(f"{name.replace('_', ' ')} {value}")
    versions = (
        f"policy {record.played_version}, language {record.language_version}, environment "
        f"{record.environment_version}, roboirg {record.package_version}"
    )
    return f"{', '.join(parts)}; {versions}"
