"""Play the stored actions of an episode again, without the policy that chose them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from roboirg.core.arms import OTHER_GOAL, TOLD
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.observations import Observation
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.evaluation.episode_errors import EpisodeError
from roboirg.evaluation.play.call_guard import CallGuard
from roboirg.evaluation.play.episode_record import begin_record
from roboirg.evaluation.play.job_instruction import PreparedJob, has_other_words
from roboirg.evaluation.play.rollout import play_with
from roboirg.evaluation.records.action_log import ActionLog
from roboirg.evaluation.records.record import Job, Record


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
        """Return the next answer.

        Raises:
            EOFError: there is none.
        """
        answer = next(self._answers, None)
        if answer is None:
            self.is_used_up = True
            raise EOFError("the actions end before the episode does")
        return answer


def replay(record: Record, log: ActionLog) -> tuple[Record, ActionLog | None]:
    """Play the actions of a record; return the record that they lead to, and its own actions.

    Nothing is drawn. If the record is an error, the actions are played as far as they go, and
    error and cause are taken over: whether a policy raised cannot be played again.

    Raises:
        InvalidValueError: the job's wording file is missing or has changed.
    """
    prepared = PreparedJob(job_of(record))
    policy = ReplayPolicy(log)
    again = begin_record(prepared)
    played = None
    needs = PolicyNeeds(cameras=(), actions=log.space)
    try:
        loop = play_with(policy, prepared, needs, again, CallGuard(again.timings, None))
        # What was declared is taken over: the attribution of a failure begins with it.
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


def job_of(record: Record) -> Job:
    """Return what was played, without the address of the policy.

    The explicit command of the goal stands for words that are not installed: no action depends on
    what is said, and the installed words may not be able to say it.
    """
    job = msgspec.structs.replace(record.identity, wordings_file=record.wordings_file)
    if has_other_words(record):
        arm = OTHER_GOAL if job.arm == OTHER_GOAL else TOLD
        return msgspec.structs.replace(job, options=InstructionOptions(), arm=arm)
    return job
