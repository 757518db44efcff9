"""The episode and the words of a job."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from roboirg import language
from roboirg.core.episode import Episode
from roboirg.evaluation.records.record import Job
from roboirg.language.arms import arm_episode, say_arm
from roboirg.language.instruction import Instruction
from roboirg.language.settings import EXPLICIT
from roboirg.language.wordings.wording_store import open_wordings
from roboirg.tasks.splits import splits


@dataclass(frozen=True)
class PreparedJob:
    """A job with its episode and its words, each made once, when it is first read."""

    job: Job

    @cached_property
    def scene_episode(self) -> Episode:
        """The scene's own episode; raises `InvalidValueError` if there is none of that number."""
        return splits.get_episode(self.job.task, self.job.split, self.job.episode)

    @cached_property
    def episode(self) -> Episode:
        """The episode with the goal by which the verdict falls; raises like `arm_episode`."""
        return arm_episode(self.scene_episode, self.job.arm)

    @cached_property
    def instruction(self) -> Instruction:
        """The instruction; raises like `instruct_job`."""
        self.open_wordings()
        return say_arm(self.scene_episode, self.job.options, self.job.arm).instruction

    @cached_property
    def explicit(self) -> Instruction:
        """The explicit instruction of the goal of `episode`; raises like `instruct_job`."""
        self.open_wordings()
        return language.instruct_with(self.episode, replace(self.job.options, setting=EXPLICIT))

    def open_wordings(self) -> None:
        """Open the job's wording file, if it has one; raises like `instruct_job`."""
        if self.job.options.wordings is not None:
            open_wordings(self.job.wordings_file, self.job.options.wordings)


def instruct_job(job: Job) -> Instruction:
    """Return the instruction of a job.

    Raises:
        InvalidValueError: the setting and options cannot express the episode, or the job's
            wording file is missing or has changed.
    """
    return PreparedJob(job).instruction
