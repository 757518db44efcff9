"""The judge: a list of stages and the facts of each step give a status.

The rule is RoboMME's: at each evaluation what the current stage forbids is tested first, then
what it expects; at most one stage is completed per evaluation, so what ends one stage is never
held against the next one in the same step.
"""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from enum import StrEnum

from roboirg.core.conditions import Fact, Rule
from roboirg.core.episode import Scene, Stage
from roboirg.judging.fact_history import FactHistory


class Status(StrEnum):
    """How the episode stands."""

    ONGOING = "ongoing"
    SUCCESS = "success"
    FAILURE = "failure"


class Judge:
    """Follows one episode.

    Args:
        stages: what has to happen, in order, the demonstration's stages included.
        scene: lets the cause call things by what they are instead of by their names.

    Attributes:
        status: success and failure are final.
        index: number of completed stages.
        published: the stage that was due when the last evaluation began, or None when all are
            completed: labels change one step after the stage (RoboMME).
        cause: why the episode failed; None before that.
        broken: what was forbidden and came to hold; None before that, or if `fail` ended it.
    """

    def __init__(self, stages: Sequence[Stage], scene: Scene | None = None) -> None:
        self.stages = tuple(stages)
        self._scene = scene or Scene(())
        self.status = Status.SUCCESS if not self.stages else Status.ONGOING
        self.index = 0
        self.published = self.current
        self.cause: str | None = None
        self.broken: Fact | Rule | None = None
        self._history = FactHistory()
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
        self.published = stage
        self._history.follow(step, facts)
        if stage.timer is not None:
            self._history.start_timer(stage.timer)
        broken = next((rule for rule in stage.forbids if self._is_broken(rule)), None)
        if broken is not None:
            self.broken = broken
            self.fail(describe_violation(broken, stage, self._scene))
        elif self._completed(step, stage):
            self.index += 1
            self._held_since = None
            if self.index == len(self.stages):
                self.status, self.published = Status.SUCCESS, None
        return self.status

    def fail(self, cause: str) -> None:
        """End the episode as a failure, unless it is over already."""
        if self.status is Status.ONGOING:
            self.status, self.cause = Status.FAILURE, cause

    def _is_broken(self, rule: Fact | Rule) -> bool:
        return self._history.holds(rule.condition if isinstance(rule, Rule) else rule)

    def _completed(self, step: int, stage: Stage) -> bool:
        met = self._history.holds(stage.expects)
        if stage.lasting == 0:
            return met
        if self._held_since is None or not met:
            self._held_since = step
        return step - self._held_since >= stage.lasting


_VERBS = {"picked": "picked up", "lifted": "lifted", "pressed": "pressed"}


def describe_violation(broken: Fact | Rule, stage: Stage, scene: Scene) -> str:
    """What happened and what was due, in one line, for example for a record's cause."""
    what = broken.cause if isinstance(broken, Rule) else _describe_fact(broken, scene)
    return f"{what} while due: {plain_subgoal(stage)}"


def _describe_fact(fact: Fact, scene: Scene) -> str:
    verb = _VERBS.get(fact.kind, fact.kind.replace("_", " "))
    place = f" on {describe_object(fact.place, scene)}" if fact.place else ""
    return f"{verb} {describe_object(fact.subject, scene)}{place}"


def describe_object(name: str, scene: Scene) -> str:
    """An object as a person would point it out; its bare name if the scene does not have it."""
    item = next((item for item in scene.objects if item.name == name), None)
    if item is None:
        return name
    if item.kind != "container":
        noun = item.kind.removeprefix("hidden_")
        return f"the {item.color} {noun}" if item.color else f"the {item.kind}"
    hidden = scene.hidden_in(name)
    return f"the container over the {hidden.color} cube" if hidden else "an empty container"


def plain_subgoal(stage: Stage) -> str:
    """The stage's simple subgoal: its words without the slot for a pixel."""
    return stage.subgoal.replace("{at} ", "").replace(" {at}", "")
