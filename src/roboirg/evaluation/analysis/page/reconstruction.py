"""Parts of an episode that a record leaves out because they follow from it: resolved form, stages.

Both are derived by the installed package, so only for records of the same versions; the page
omits them for others.
"""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import msgspec

from roboirg import language
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.errors import RoboIRGError
from roboirg.evaluation.play.goal_outcomes import judged_events
from roboirg.evaluation.play.job_instruction import PreparedJob, instruct_job
from roboirg.evaluation.records.record import Record
from roboirg.judging.episode_replay import completed_stages
from roboirg.judging.judge import describe_object
from roboirg.language.settings import EXPLICIT
from roboirg.tasks.splits.splits import get_episode

_KINDS = {"shuttle": "the moving cube", "site": "the spot on the table"}
"""Words for objects that causes do not name."""


class StageMark(NamedTuple):
    """A stage of the task: its subgoal, and the control step that completed it, if any."""

    subgoal: str
    step: int | None


def resolved_form(record: Record) -> str | None:
    """Return the same instruction with every reference resolved.

    None if the record has this form already, another language or environment version, or words of
    a wording file that is gone.
    """
    if record.setting == EXPLICIT or record.form == "resolved":
        return None
    if record.language_version != language.LANGUAGE_VERSION or not _has_this_environment(record):
        return None
    try:
        job = msgspec.structs.replace(record.identity, wordings_file=record.wordings_file)
        return instruct_job(job.with_options(form="resolved")).text
    except RoboIRGError:
        return None  # a task or a wording file that is no longer there


def stages_of(record: Record) -> tuple[StageMark, ...]:
    """Return the stages of the policy's turn; none for another environment version."""
    if not record.events or not _has_this_environment(record):
        return ()
    turn = max(0, -min(event.step for event in record.events))
    events = judged_events(record.events, turn)
    last = max(record.steps, *(event.step for event in record.events))
    try:
        episode = PreparedJob(record.identity).episode
        done = completed_stages(episode, events, turn + last)
    except (RoboIRGError, KeyError):
        return ()  # a task that is no longer installed, or incomplete events
    return tuple(
        StageMark(stage.subgoal.replace(" {at}", ""), done[index] - turn if index in done else None)
        for index, stage in enumerate(episode.stages)
    )


def names_of(record: Record) -> Mapping[str, str]:
    """Return words for the objects of an episode; none for another environment version."""
    if not _has_this_environment(record):
        return {}
    try:
        return _object_names(record.task, record.split, record.episode)
    except RoboIRGError:
        return {}  # a task that is no longer installed


@functools.lru_cache(maxsize=1024)
def _object_names(task: str, split: str, episode: int) -> Mapping[str, str]:
    """Return words for each object; where two have the same, the end of their names is added."""
    scene = get_episode(task, split, episode).scene
    words = {
        one.name: _KINDS.get(one.kind) or describe_object(one.name, scene) for one in scene.objects
    }
    counts = Counter(words.values())
    return MappingProxyType(
        {
            name: text if counts[text] == 1 else f"{text} ({name.rpartition('_')[2]})"
            for name, text in words.items()
        }
    )


def _has_this_environment(record: Record) -> bool:
    return record.environment_version == ENVIRONMENT_VERSION
