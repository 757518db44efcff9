"""The run in which the scripted expert plays what people answered."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import PrivateAttr

from roboirg.apps.people.listener_answers import read_events, standing_answers
from roboirg.apps.people.listening_study import PEOPLE, read_listening_study
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.records.record import Job

RUN = "run"
"""Folder of the run in the folder of the study."""


class AnsweredPlan(Plan):
    """A plan of which only the episodes are played that were answered."""

    _answered: frozenset[tuple[object, ...]] = PrivateAttr(frozenset())

    def jobs(self) -> tuple[Job, ...]:
        """Return every job with an answer."""
        return tuple(job for job in super().jobs() if _key(job) in self._answered)


def answered_plan(folder: Path) -> Plan:
    """Return the plan of what people have answered so far.

    Raises:
        InvalidValueError: the folder holds no study, or there are no answers.
        StoreError: the answers cannot be read.
    """
    study = read_listening_study(folder)
    answers = [one for one in standing_answers(read_events(folder)) if one.kind == "item"]
    if not answers:
        raise InvalidValueError(f"No question of {str(folder)!r} has been answered yet.")
    seeds = tuple(range(1 + max(one.policy_seed for one in answers)))
    fields: dict[str, Any] = dict(study.plan) | {
        "policies": (f"{PEOPLE}={PEOPLE}:{folder.absolute()}",),
        "policy_seeds": seeds,
    }
    plan = AnsweredPlan(**fields)
    plan._answered = frozenset(map(_key, answers))  # noqa: SLF001 - of this module
    return plan


def _key(one: Any) -> tuple[object, ...]:  # noqa: ANN401 - a job or an answer
    return one.task, one.split, one.episode, one.setting, one.form, one.policy_seed
