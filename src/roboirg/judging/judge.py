"""The judge: a list of stages and the facts of each step give a status.

The rule is RoboMME's: at each evaluation the current stage's forbidden facts are tested first,
then the fact that it expects; at most one stage is completed per evaluation, so what ends one
stage is never held against the next one in the same step.
"""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from enum import StrEnum

from roboirg.episode import Fact, Stage


class Status(StrEnum):
    """How the episode stands."""

    ONGOING = "ongoing"
    SUCCESS = "success"
    FAILURE = "failure"


class Judge:
    """Follows one episode.

    Args:
        stages: what has to happen, in order, the demonstration's stages included.

    Attributes:
        status: success and failure are final.
        index: number of completed stages.
        cause: why the episode failed; None before that.
    """

    def __init__(self, stages: Sequence[Stage]) -> None:
        self.stages = tuple(stages)
        self.status = Status.SUCCESS if not self.stages else Status.ONGOING
        self.index = 0
        self.cause: str | None = None
        self._held_since: int | None = None

    @property
    def current(self) -> Stage | None:
        """The stage that is due, or None when all are completed."""
        return self.stages[self.index] if self.index < len(self.stages) else None

    def update(self, step: int, facts: AbstractSet[Fact]) -> Status:
        """Evaluate once.

        Args:
            step: control steps since reset.
            facts: all that hold now.

        Returns:
            The status after the evaluation.
        """
        stage = self.current
        if self.status is not Status.ONGOING or stage is None:
            return self.status
        broken = next((fact for fact in stage.forbids if fact in facts), None)
        if broken is not None:
            self.status = Status.FAILURE
            self.cause = describe_violation(broken, stage)
        elif self._completed(step, stage, facts):
            self.index += 1
            self._held_since = None
            if self.index == len(self.stages):
                self.status = Status.SUCCESS
        return self.status

    def _completed(self, step: int, stage: Stage, facts: AbstractSet[Fact]) -> bool:
        if stage.lasting == 0:
            return stage.expects in facts
        if self._held_since is None or stage.expects not in facts:
            self._held_since = step
        return step - self._held_since >= stage.lasting


def describe_violation(fact: Fact, stage: Stage) -> str:
    """One line that says what happened and what was due, for example for a record's cause."""
    what = f"{fact.kind} {fact.subject}" + (f" on {fact.place}" if fact.place else "")
    return f"{what} while due: {plain_subgoal(stage)}"


def plain_subgoal(stage: Stage) -> str:
    """The stage's simple subgoal: its words without the slot for a pixel."""
    return stage.subgoal.replace("{at} ", "").replace(" {at}", "")
