"""The instruction of a job."""

from __future__ import annotations

from roboirg import language
from roboirg.evaluation.records.record import Job
from roboirg.language.instruction import Instruction
from roboirg.language.wordings.wording_store import open_wordings
from roboirg.tasks.splits import splits


def instruct_job(job: Job) -> Instruction:
    """Return the instruction of a job.

    Raises:
        InvalidValueError: the setting and options cannot express the episode, or the job's
            wording file is missing or has changed.
    """
    episode = splits.get_episode(job.task, job.split, job.episode)
    if job.options.wordings is not None:
        open_wordings(job.wordings_file, job.options.wordings)
    return language.instruct_with(episode, job.options)
