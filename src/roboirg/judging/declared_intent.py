"""What a policy declared that it would do: it comes before what the acts look like."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from roboirg.core.episode import Episode, SlotValue, describe_goal, values_in
from roboirg.core.failures import FailureName
from roboirg.judging.failure_attribution import FailureAttribution

_OF_VERDICT: Mapping[str, FailureName] = {
    "wrong_thing": "wrong_object",
    "wrong_place": "wrong_place",
    "wrong_count": "wrong_count",
}


class DeclaredIntent(NamedTuple):
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
        """Return what the declaration makes of a failure that the acts show.

        Who declared something wrong failed by grounding, whatever the hands did; who declared the
        right thing did not. A subgoal that was not due at all decides nothing.
        """
        if self.listens:
            return self._revise_listener(found, episode)
        said = [verdict for step, verdict in self.verdicts if step <= found.step]
        if said and (failure := _OF_VERDICT.get(said[-1])) and found.kind != "grounding":
            words = f"named something else than what was due: {found.sentence[:-1]}"
            return FailureAttribution.of(failure, found.subject, found.step, words)
        return _not_followed(found) if said and said[-1] == "right" else found

    def _revise_listener(self, found: FailureAttribution, episode: Episode) -> FailureAttribution:
        meant = episode.goal.as_mapping()
        if self.understood is None:
            return FailureAttribution.of("no_answer", None, 0, "the model named no goal")
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
    return {slot: values_in(content) for slot, content in goal.items()}
