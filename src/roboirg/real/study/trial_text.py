"""What is said in a trial or demonstration, and what the arrangement is, in words."""

from __future__ import annotations

from roboirg import language
from roboirg.evaluation.plan import instruct_job
from roboirg.real.pages.arrangement_drawing import shapes_of, where
from roboirg.real.study.study_plan import PlannedDemonstration, PlannedTrial


def turns_of(planned: PlannedTrial | PlannedDemonstration) -> tuple[str, ...]:
    """The utterances, in the order in which they are spoken."""
    if isinstance(planned, PlannedTrial):
        return instruct_job(planned.job).turns
    return language.instruct(planned.episode, "explicit").turns


def meant_by(planned: PlannedTrial | PlannedDemonstration) -> str:
    """What the robot is to do, for who judges: the same in plain words."""
    return language.instruct(planned.episode, "explicit").command


def places_of(planned: PlannedTrial | PlannedDemonstration) -> tuple[str, ...]:
    """Where everything lies, a line for each thing."""
    return tuple(where(shape) for shape in shapes_of(planned.episode.scene))
