"""The episode and the words of a job, its policy's seed, and of which versions a record is."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

from roboirg.core.arms import AGAIN, TOLD
from roboirg.core.episode import ENVIRONMENT_VERSION, Episode
from roboirg.core.errors import InvalidValueError
from roboirg.core.versions import WORDS, Mismatch, Versions
from roboirg.language import LANGUAGE_VERSION
from roboirg.language.arms import TrialWords, arm_episode, say_arm, word_trial
from roboirg.language.instruction import Instruction
from roboirg.language.scenarios.identity import words_of
from roboirg.language.scenarios.wording_store import open_wordings
from roboirg.records.record import Job, Summary
from roboirg.tasks.splits import splits

INSTALLED = Versions(environment_version=ENVIRONMENT_VERSION, language_version=LANGUAGE_VERSION)
"""Of which versions new records are; which words they have depends on task and pool."""


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
    """Return the instruction of a job: what is said of its episode in its control arm.

    Raises:
        InvalidValueError: the setting and options cannot express the episode, or the job's
            wording file is missing or has changed.
    """
    _open_wordings(job)
    return say_arm(PreparedJob(job).scene_episode, job.options, job.arm).instruction


def _open_wordings(job: Job) -> None:
    """Open the wording file of a job, if it has one; raises if it is missing or has changed."""
    if job.options.wordings is not None:
        open_wordings(job.wordings_file, job.options.wordings)


def other_versions(record: Summary) -> list[Mismatch]:
    """Return in which versions, of language, words or environment, a record is not as installed.

    Empty if it could have been made with what is installed now.
    """
    words = installed_words(record)
    if words is None:
        # They are of a wording file that is gone: they cannot be compared, so they count as equal.
        words = record.words
    recorded = Versions(
        environment_version=record.environment_version,
        language_version=record.language_version,
        words_version=record.words,
    )
    return recorded.differences(INSTALLED._replace(words_version=words))


def installed_words(job: Job) -> str | None:
    """Return the identity of the words that are installed for a job, with a hash of them.

    For example ``PickXtimes/test@1a2b3c4d5e6f``. None if the job uses a wording file that is
    missing or has changed.
    """
    try:
        _open_wordings(job)
    except InvalidValueError:
        return None
    return words_of(job.task, job.pool, job.setting, job.options.wordings)


def has_other_words(record: Summary) -> bool:
    """Return whether a record's words are not those that this package has for its job."""
    return any(mismatch.what == WORDS for mismatch in other_versions(record))


def episode_policy_seed(policy_seed: int, episode_seed: int, arm: str = TOLD) -> int:
    """Return a policy's seed in an episode: the same in every setting, another in every episode.

    Args:
        policy_seed: of the plan.
        episode_seed: of the episode's scene.
        arm: of the episode; `AGAIN` has another seed, and all others have the same.

    Returns:
        A number below 2**32.
    """
    # Stored runs depend on these texts: with others, their policies would act differently.
    text = f"|{policy_seed}|{episode_seed}"
    if arm == AGAIN:
        text = f"|{AGAIN}{text}"
    digest = hashlib.sha256(text.encode()).digest()
    return int.from_bytes(digest[:4], "big")  # 4 bytes, as seeds are below 2**32
