"""The texts of a trial or demonstration for the operator."""

from __future__ import annotations

from roboirg import language
from roboirg.apps.real.study.arrangement_shapes import describe_position, scene_shapes
from roboirg.apps.real.study.study_plan import PlannedDemonstration, PlannedTrial
from roboirg.evaluation.play.job_instruction import instruct_job
from roboirg.language.settings import EXPLICIT


def spoken_turns(planned: PlannedTrial | PlannedDemonstration) -> tuple[str, ...]:
    """Return the utterances in the order in which they are spoken."""
    if isinstance(planned, PlannedTrial):
        return instruct_job(planned.job).turns
    return language.instruct(planned.episode, EXPLICIT).turns


def explicit_command(planned: PlannedTrial | PlannedDemonstration) -> str:
    """Return the command in explicit words, for the operator who judges the trial."""
    return language.instruct(planned.episode, EXPLICIT).command


def describe_positions(planned: PlannedTrial | PlannedDemonstration) -> tuple[str, ...]:
    """Return the position of each object, a line for each."""
    return tuple(describe_position(shape) for shape in scene_shapes(planned.episode.scene))
