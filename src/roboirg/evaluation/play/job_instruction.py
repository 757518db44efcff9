"""The episode and the words of a job."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from roboirg import language
from roboirg.core.episode import Episode
from roboirg.evaluation.records.record import Job
from roboirg.language.instruction import Instruction
from roboirg.language.settings import EXPLICIT
from roboirg.language.wordings.wording_store import open_wordings
from roboirg.tasks.splits import splits


@dataclass(frozen=True)
class PreparedJob:
    """A job with its episode and its words, each made once, when it is first read."""

    job: Job

    @cached_property
    def episode(self) -> Episode:
        """The episode; raises `InvalidValueError` if there is none of that number."""
        return splits.get_episode(self.job.task, self.job.split, self.job.episode)

    @cached_property
    def instruction(self) -> Instruction:
        """The instruction; raises like `instruct_job`."""
        return self._say(self.job.setting)

    @cached_property
    def explicit(self) -> Instruction:
        """The explicit instruction of the same episode; raises like `instruct_job`."""
        return self._say(EXPLICIT)

    def _say(self, setting: str) -> Instruction:
        job, episode = self.job, self.episode
        if job.options.wordings is not None:
            open_wordings(job.wordings_file, job.options.wordings)
        return language.instruct_with(episode, replace(job.options, setting=setting))


def instruct_job(job: Job) -> Instruction:
    """Return the instruction of a job.

    Raises:
        InvalidValueError: the setting and options cannot express the episode, or the job's
            wording file is missing or has changed.
    """
    return PreparedJob(job).instruction
