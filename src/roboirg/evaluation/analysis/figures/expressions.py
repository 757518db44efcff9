"""Figure: number of scenes with each class of referring expression."""

from __future__ import annotations

from pathlib import Path

from roboirg import language
from roboirg.core.errors import RoboIRGError
from roboirg.evaluation.analysis.figures.expression_figure import write_figure
from roboirg.evaluation.analysis.figures.figure_data import FigureData
from roboirg.evaluation.play.job_instruction import instruct_job
from roboirg.evaluation.records.record import Job
from roboirg.language.instruction import Instruction
from roboirg.language.settings import EXPLICIT

TITLE = "Referring expressions in the instructions"


def write_expressions(content: FigureData, folder: Path, name: str) -> tuple[Path, ...]:
    """Draw the referring expressions of the runs; return no files without implicit instructions.

    Results do not hold the instructions, so they are generated again, if the language has the same
    version.

    Raises:
        MissingDependencyError: matplotlib is not installed.
        InvalidValueError: the folder is not writable.
    """
    jobs = [
        result.identity.model_copy(
            update={"policy": "", "policy_seed": 0, "wordings_file": result.wordings_file}
        )
        for _, result in content.results
        if result.form == "implicit" and result.setting != EXPLICIT
        if result.language_version == language.LANGUAGE_VERSION
    ]
    found = [one for job in dict.fromkeys(jobs) if (one := _instruction(job)) is not None]
    return write_figure(found, folder, name, TITLE) if found else ()


def _instruction(job: Job) -> Instruction | None:
    try:
        return instruct_job(job)
    except RoboIRGError:
        return None  # a task that is no longer installed
