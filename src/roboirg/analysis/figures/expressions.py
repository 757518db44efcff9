"""Figure: in how many scenes each class of referring expression was said."""

from __future__ import annotations

from pathlib import Path

from roboirg import language
from roboirg.analysis.figures.figure_data import FigureData
from roboirg.core.errors import RoboIRGError
from roboirg.evaluation.plan import instruct_job
from roboirg.language.expression_figure import write_figure
from roboirg.language.instruction import Instruction
from roboirg.records.record import Job

TITLE = "Referring expressions that were said"


def write_expressions(content: FigureData, folder: Path, name: str) -> tuple[Path, ...]:
    """Draw what the instructions of the runs consist of; nothing without implicit ones.

    Results do not hold the words. They are said again, which only the version of the language
    that said them can.

    Raises:
        MissingDependencyError: matplotlib is not installed.
        InvalidValueError: the folder cannot be written to.
    """
    told = [
        result.identity.model_copy(update={"policy": "", "policy_seed": 0})
        for _, result in content.results
        if result.form == "implicit" and result.setting != "explicit"
        if result.language_version == language.LANGUAGE_VERSION
    ]
    said = [one for job in dict.fromkeys(told) if (one := _say(job)) is not None]
    return write_figure(said, folder, name, TITLE) if said else ()


def _say(job: Job) -> Instruction | None:
    try:
        return instruct_job(job)
    except RoboIRGError:
        return None  # a task that is no longer installed
