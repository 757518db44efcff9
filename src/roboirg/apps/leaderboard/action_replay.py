"""Play the stored actions of an episode again, without the policy that chose them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from roboirg.core.arms import OTHER_GOAL, TOLD
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.observations import Observation
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.language.arms import TrialWords, word_trial
from roboirg.language.instruction import Mention, Utterance
from roboirg.records.action_log import ActionLog
from roboirg.records.record import Record
from roboirg.runs.episode_errors import EpisodeError
from roboirg.runs.job_instruction import PreparedJob, has_other_words
from roboirg.runs.play.call_guard import CallGuard
from roboirg.runs.play.episode_record import begin_record
from roboirg.runs.play.rollout import play_with


class ReplayPolicy:
    """Answers what another policy answered, and looks at nothing.

    Args:
        log: the answers.

    Attributes:
        is_used_up: whether it was asked once more after its last answer.
    """

    cameras = ()

    def __init__(self, log: ActionLog) -> None:
        self.actions = log.space
        self.is_used_up = False
        self._answers = iter(log.chunks())

    def reset(self, instruction: str, demonstration: Mapping[str, Any]) -> None:
        """Start an episode."""

    def act(self, observation: Observation) -> NDArray[np.float64]:  # noqa: ARG002
        """Return the next recorded answer, whatever is observed.

        Raises:
            EOFError: all have been given.
        """
        answer = next(self._answers, None)
        if answer is None:
            self.is_used_up = True
            raise EOFError("the actions end before the episode does")
        return answer


def replay(record: Record, log: ActionLog) -> tuple[Record, ActionLog | None]:
    """Play the actions of a record again; return the new record, and the actions that it took.

    The actions are None if the episode did not begin. No picture is drawn. If the record is an
    error, its actions are played as far as they go, and the new record gets the same error and
    cause: actions do not show whether a policy raised. `record` and `log` stay as they are.

    Raises:
        InvalidValueError: the job's wording file is missing or has changed.
    """
    prepared = prepared_job(record)
    policy = ReplayPolicy(log)
    again = begin_record(prepared)
    played = None
    needs = PolicyNeeds(cameras=(), actions=log.space)
    try:
        loop = play_with(policy, prepared, needs, again, CallGuard(again.timings, None))
        # Copied before `conclude`, which explains a failure by what the policy had declared.
        again.policy_metadata = record.policy_metadata
        again.subgoals = record.subgoals
        loop.conclude()
        played = loop.log
    except EpisodeError as error:
        again.record_error(error.kind, error.cause)
    if policy.is_used_up and record.outcome == "error":
        again.error = record.error
        again.cause = record.cause
    again.action_log = None if played is None else played.digest
    return again, played


@dataclass(frozen=True)
class RecordedJob(PreparedJob):
    """A job with the words of its record, which are not those of this package.

    Only the goals come from this package.
    """

    record: Record

    @cached_property
    def words(self) -> TrialWords:
        """What is said in the trial: utterances and command of the record, not the installed words.

        For records whose words are of another version, so that making them again would give others.
        The goal is made here, in the arm (kind of comparison) that decides it: `OTHER_GOAL`, or
        `TOLD` for all others. What the words mean (`meaning`) stays open: the record does not hold
        it.
        """
        arm = OTHER_GOAL if self.job.arm == OTHER_GOAL else TOLD
        explicit = word_trial(self.scene_episode, InstructionOptions(), arm)
        # Typed Any, as stages and roles of a stranger's record may be any text; none are read here.
        said: list[Any] = list(self.record.instruction)
        utterances = [Utterance(utterance.stage, utterance.text) for utterance in said]
        spans: list[Any] = [msgspec.structs.asdict(span) for span in self.record.mentions]
        mentions = [Mention(**span) for span in spans]
        instruction = replace(
            explicit.instruction,
            setting=self.job.setting,
            utterances=tuple(utterances),
            mentions=tuple(mentions),
            meaning=None,
        )
        return explicit._replace(instruction=instruction, command=self.record.command)


def prepared_job(record: Record) -> PreparedJob:
    """Return the job of a record, ready to be played: what was to be done, and what was said.

    The address of the policy is left out. If the record's words are not those of this package, they
    are taken from the record.
    """
    job = msgspec.structs.replace(record.identity, wordings_file=record.wordings_file)
    if has_other_words(record):
        return RecordedJob(job, record)
    return PreparedJob(job)
