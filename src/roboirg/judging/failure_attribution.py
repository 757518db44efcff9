"""The result of a failure analysis, and the names of failures."""

from __future__ import annotations

from typing import Literal, NamedTuple, get_args

from roboirg.core.conditions import ExecutionFailure, GroundingFailure

FailureName = GroundingFailure | ExecutionFailure

GROUNDING: tuple[GroundingFailure, ...] = get_args(GroundingFailure)
EXECUTION: tuple[ExecutionFailure, ...] = get_args(ExecutionFailure)


class FailureAttribution(NamedTuple):
    """Why an episode failed.

    Attributes:
        kind: ``grounding`` (the policy did something else than the instruction means) or
            ``execution`` (it did not complete what the instruction means).
        failure: which of the kind, one of `GROUNDING` or `EXECUTION`.
        subject: name of the object that it is about, if there is one.
        step: control step of the policy's turn at which it showed.
        sentence: the same in words.
    """

    kind: Literal["grounding", "execution"]
    failure: FailureName
    subject: str | None
    step: int
    sentence: str

    @classmethod
    def of(
        cls, failure: FailureName, subject: str | None, step: int, words: str
    ) -> FailureAttribution:
        """Return an attribution of the kind of the failure; the words become a sentence."""
        kind: Literal["grounding", "execution"] = (
            "grounding" if failure in GROUNDING else "execution"
        )
        return cls(kind, failure, subject, step, f"{words[0].upper()}{words[1:]}.")
