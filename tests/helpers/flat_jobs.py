"""Jobs and results whose options are given among the other fields."""

from __future__ import annotations

from dataclasses import fields

from roboirg.core.environment_options import EnvironmentOptions
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.records.record import Job


def nested(**given: object) -> dict[str, object]:
    """Return fields of a job, in which options have their places."""
    others = dict(given)
    for name, kind in (("options", InstructionOptions), ("environment", EnvironmentOptions)):
        names = [one.name for one in fields(kind)]
        own = {one: others.pop(one) for one in names if one in others}
        others.setdefault(name, kind(**own))
    return others


def job_of(**given: object) -> Job:
    return Job(**nested(**given))
