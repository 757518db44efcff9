"""What a policy declared that it would do: it comes before what the acts look like."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from roboirg.core.episode import Episode, SlotValue, describe_goal, values_in
from roboirg.core.failures import FailureName
from roboirg.judging.failure_attribution import FailureAttribution

_FAILURE_BY_VERDICT: Mapping[str, FailureName] = {
    "wrong_thing": "wrong_object",
    "wrong_place": "wrong_place",
    "wrong_count": "wrong_count",
}
"""The failure of a policy whose last subgoal got a verdict."""


@dataclass(frozen=True)
class DeclaredIntent:
    """What a listener understood, or how a planner's subgoals compare with what was due.

    Attributes:
        listens: whether a model names the goal.
        understood: the goal that it named, a value for each slot; None if it named none.
        verdicts: for each subgoal of a planner its control step of the policy's turn, and one of
            `roboirg.judging.subgoal_verdicts.SUBGOAL_VERDICTS`.
    """

    listens: bool = False
    understood: Mapping[str, SlotValue] | None = None
    verdicts: tuple[tuple[int, str], ...] = ()

    def revise(self, found: FailureAttribution, episode: Episode) -> FailureAttribution:
        """Return the failure that the acts show, corrected by what the policy declared it would do.

        A policy that declared something wrong failed by grounding, whatever its hands did; one that
        declared the right thing understood, and its hands did not follow. If the hands took the
        blue cube:

        - with the verdict ``"wrong_thing"`` on the last subgoal it is ``wrong_object``;
        - with ``"right"`` it is ``not_followed``;
        - with any other, or none, such as a subgoal that was not due, the failure stays as it is.

        Args:
            found: the failure that the acts alone show.
            episode: with the goal that was meant.
        """
        if self.listens:
            return self._revise_listener(found, episode)
        verdicts = [verdict for said_at, verdict in self.verdicts if said_at <= found.step]
        last_verdict = verdicts[-1] if verdicts else ""
        if last_verdict == "right":
            return _not_followed(found)
        declared = _FAILURE_BY_VERDICT.get(last_verdict)
        if declared is None or found.kind == "grounding":
            return found
        words = f"named something else than what was due: {found.sentence[:-1]}"
        return FailureAttribution.of(declared, found.subject, found.step, words)

    def _revise_listener(self, found: FailureAttribution, episode: Episode) -> FailureAttribution:
        """Return the failure of a policy whose model named the goal that it understood.

        It named no goal, ``no_answer``; a wrong one, ``misunderstood``; or the right one, which its
        hands did not follow.
        """
        if self.understood is None:
            return FailureAttribution.of("no_answer", None, 0, "the model named no goal")
        meant = episode.goal.as_mapping()
        if _slots(self.understood) != _slots(meant):
            words = f"understood {describe_goal(self.understood)}; meant {describe_goal(meant)}"
            return FailureAttribution.of("misunderstood", None, 0, words)
        return _not_followed(found)


def _not_followed(found: FailureAttribution) -> FailureAttribution:
    """Return a failure of the hands of a policy that had declared the right thing."""
    if found.kind == "execution":
        return found
    words = f"declared what was due: {found.sentence[:-1]}"
    return FailureAttribution.of("not_followed", found.subject, found.step, words)


def _slots(goal: Mapping[str, SlotValue]) -> dict[str, tuple[str | int, ...]]:
    """Return the slots of a goal so that they can be compared: each with all of its values."""
    return {slot: values_in(content) for slot, content in goal.items()}
