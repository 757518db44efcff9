"""The result of a failure analysis."""

from __future__ import annotations

from typing import NamedTuple

from roboirg.core.failures import FAILURES, FailureKind, FailureName


class FailureAttribution(NamedTuple):
    """Why an episode failed.

    Attributes:
        kind: as in `roboirg.core.failures.FAILURE_KINDS`.
        failure: its name, a key of `roboirg.core.failures.FAILURES`.
        subject: name of the object that it is about, if there is one.
        step: control step of the policy's turn at which it showed.
        sentence: the same in words.
    """

    kind: FailureKind
    failure: FailureName
    subject: str | None
    step: int
    sentence: str

    @classmethod
    def of(
        cls, failure: FailureName, subject: str | None, step: int, words: str
    ) -> FailureAttribution:
        """Return an attribution of the kind of the failure; the words become a sentence."""
        sentence = f"{words[0].upper()}{words[1:]}."
        return cls(FAILURES[failure].kind, failure, subject, step, sentence)
