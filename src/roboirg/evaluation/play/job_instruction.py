"""The episode and the words of a job."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from roboirg.core.episode import Episode
from roboirg.evaluation.records.record import Job
from roboirg.language.arms import TrialWords, arm_episode, say_arm, word_trial
from roboirg.language.instruction import Instruction
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
    def words(self) -> TrialWords:
        """Everything that is said of it; raises like `instruct_job`."""
        _open_wordings(self.job)
        return word_trial(self.scene_episode, self.job.options, self.job.arm)


def instruct_job(job: Job) -> Instruction:
    """Return the instruction of a job.

    Raises:
        InvalidValueError: the setting and options cannot express the episode, or the job's
            wording file is missing or has changed.
    """
    _open_wordings(job)
    return say_arm(PreparedJob(job).scene_episode, job.options, job.arm).instruction


def _open_wordings(job: Job) -> None:
    if job.options.wordings is not None:
        open_wordings(job.wordings_file, job.options.wordings)
