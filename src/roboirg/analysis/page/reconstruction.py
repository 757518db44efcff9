"""What a record leaves out because it follows from the rest: the resolved form, the stages.

Both come from the installed package, so only for records of its own versions; for others the page
does without.
"""

from __future__ import annotations

from typing import NamedTuple

from roboirg import language
from roboirg.core.conditions import Fact
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.errors import RoboIRGError
from roboirg.episodes.splits import get_episode
from roboirg.evaluation.plan import instruct_job
from roboirg.judging import Event
from roboirg.judging.episode_replay import rejudge
from roboirg.records.record import Record


class StageMark(NamedTuple):
    """A stage of the task: what it asks for, and the control step that completed it, if any."""

    subgoal: str
    step: int | None


def resolved_form(record: Record) -> str | None:
    """The same instruction with every reference spelled out.

    None where the record is that already, or was told by another version of the language.
    """
    if record.setting == "explicit" or record.form == "resolved":
        return None
    if record.language_version != language.LANGUAGE_VERSION or not _is_of_this_world(record):
        return None
    try:
        return instruct_job(record.identity.model_copy(update={"form": "resolved"})).text
    except RoboIRGError:
        return None  # a task that is no longer installed


def stages_of(record: Record) -> tuple[StageMark, ...]:
    """The stages of the policy's turn; none where another version of the worlds was played."""
    if not record.events or not _is_of_this_world(record):
        return ()
    turn = max(0, -min(event.step for event in record.events))
    events = [
        Event(one.step + turn, Fact(one.kind, one.subject, one.place), one.holds)
        for one in record.events
    ]
    last = max(record.steps, *(event.step for event in record.events))
    try:
        episode = get_episode(record.task, record.split, record.episode)
        trace = rejudge(episode, events, turn, turn + last)
    except (RoboIRGError, KeyError):
        return ()  # a task that is no longer installed, or events that are not all there
    done = {
        stage: step - turn
        for step, stage in enumerate(trace.expected_stages)
        if trace.completed(step) is not None
    }
    return tuple(
        StageMark(stage.subgoal.replace(" {at}", ""), done.get(index))
        for index, stage in enumerate(trace.stages)
    )


def _is_of_this_world(record: Record) -> bool:
    return record.environment_version == ENVIRONMENT_VERSION
