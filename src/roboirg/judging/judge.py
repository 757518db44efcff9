"""The judge: follow the facts of each step through a list of stages.

As in RoboMME, each evaluation first tests what the current stage forbids, then what it expects.
It completes at most one stage, so an act that completes one never violates the next in the same
step.

*Fact*: what the world reports, the red cube is up. *Stage*: what has to happen next, and what must
not. *Evaluation*: a step at which the judge looks at the facts. `Judge` has the state of the
episode, `_StageWatch` the rules of the current stage.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet
from enum import StrEnum

from roboirg.core.conditions import All, Condition, Elapsed, Fact, Rule
from roboirg.core.episode import Episode, Scene, Stage
from roboirg.judging.fact_history import FactHistory

_PLAINER_SUBGOALS = {"remain static": "wait"}
"""Subgoals of RoboMME, and what a cause says instead."""


class Status(StrEnum):
    """Status of an episode."""

    ONGOING = "ongoing"
    SUCCESS = "success"
    FAILURE = "failure"


class Judge:
    """Judges one episode: where it stands, and how each evaluation moves it on.

    Args:
        stages: what has to happen, in order, the demonstration's stages included.
        scene: lets the cause describe objects instead of naming them.

    Attributes:
        stages: as given.
        status: success and failure are final.
        index: number of completed stages, and so that of the current one.
        published: the current stage when the last evaluation began, or None when all are
            completed: labels change one step after the stage (RoboMME).
        cause: why the episode failed; None before that.
        violation: the forbidden fact or rule that came to hold; None before that, or if `fail`
            ended the episode.
    """

    def __init__(self, stages: Sequence[Stage], scene: Scene | None = None) -> None:
        """Begin with the first stage: ``ongoing``, or ``success`` if there are no stages."""
        self.stages = tuple(stages)
        self.status = Status.SUCCESS if not self.stages else Status.ONGOING
        self.index = 0
        self.published = self.current
        self.cause: str | None = None
        self.violation: Fact | Rule | None = None
        self._scene = scene or Scene(())
        self._history = FactHistory()  # of the whole episode
        self._watch: _StageWatch | None = None  # None until the current stage is first evaluated

    @classmethod
    def of(cls, episode: Episode) -> Judge:
        """Return a judge of an episode, which follows its demonstration, too."""
        return cls((*episode.demonstration, *episode.stages), episode.scene)

    @property
    def current(self) -> Stage | None:
        """The stage to complete next, or None when all are completed."""
        return self.stages[self.index] if self.index < len(self.stages) else None

    def next_change(self) -> float:
        """Return the next step at which the time alone may complete or violate the current stage.

        A stage that expects 100 steps to pass, evaluated at step 20 -> 100. Infinity if only facts
        can change anything, or if the episode is over; the next step if the stage has just begun.
        """
        if self.status is not Status.ONGOING:
            return math.inf
        if self._watch is None:
            return self._history.step + 1  # a new stage, which the next step evaluates first
        return self._watch.next_change(self._history)

    def update(self, step: int, facts: AbstractSet[Fact]) -> Status:
        """Move the episode on by the facts that hold at a step, and return its status.

        `step` counts control steps since reset. What the current stage forbids is tested first,
        then what it expects: who does both in the same step fails. At most one stage is completed
        in a step.
        """
        stage = self.current
        if self.status is not Status.ONGOING or stage is None:
            return self.status
        self.published = stage
        self._history.update(step, facts)
        if stage.timer is not None:
            self._history.start_timer(stage.timer)
        if self._watch is None:
            self._watch = _StageWatch(stage, step)

        self.violation = self._watch.first_violated(self._history)
        if self.violation is not None:
            self.fail(describe_violation(self.violation, stage, self._scene))
        elif self._watch.completes(self._history):
            self.index += 1
            self._watch = None
            if self.index == len(self.stages):
                self.status = Status.SUCCESS
                self.published = None
        return self.status

    def fail(self, cause: str) -> None:
        """End the episode as a failure, unless it is over."""
        if self.status is Status.ONGOING:
            self.status = Status.FAILURE
            self.cause = cause


class _StageWatch:
    """The rules of one stage, from its first evaluation until it is completed.

    The history, which each method gets, has the facts of the last evaluation and its step.
    """

    def __init__(self, stage: Stage, first_step: int) -> None:
        self._stage = stage
        self._first_step = first_step
        self._elapsed = tuple(_time_conditions(stage))
        # Since which step all evaluations have met what the stage expects; None if the last one
        # did not. Only of a stage that has to last.
        self._met_since: int | None = None

    def next_change(self, history: FactHistory) -> float:
        """Return the next step at which time alone may complete or violate the stage."""
        changes = [history.next_change(condition) for condition in self._elapsed]
        if self._met_since is not None:
            changes.append(self._met_since + self._stage.lasting)
        return min(changes, default=math.inf)

    def first_violated(self, history: FactHistory) -> Fact | Rule | None:
        """Return the first forbidden fact or rule that holds; None if none does."""
        for forbidden in self._stage.forbids:
            if history.holds(_condition_of(forbidden)):
                return forbidden
        return None

    def completes(self, history: FactHistory) -> bool:
        """Return whether the stage is complete, and remember since when it has been met.

        A stage with `lasting` is complete when what it expects has held for that many steps
        without a break; any other, at once.
        """
        is_met = history.holds(self._stage.expects)
        if self._stage.lasting == 0:
            return is_met
        if not is_met:
            self._met_since = None
            return False
        if self._met_since is None:
            # Later than at the first evaluation, it has been met for one step already.
            self._met_since = max(history.step - 1, self._first_step)
        return history.step - self._met_since >= self._stage.lasting


def _condition_of(forbidden: Fact | Rule) -> Condition:
    """Return what must not hold, of a rule without its words."""
    return forbidden.condition if isinstance(forbidden, Rule) else forbidden


def _time_conditions(stage: Stage) -> Iterator[Elapsed]:
    """Yield the conditions on time in what a stage expects and forbids: *100 steps passed*."""
    conditions: list[Condition] = [stage.expects]
    conditions += [_condition_of(forbidden) for forbidden in stage.forbids]
    for condition in conditions:
        parts = condition.of if isinstance(condition, All) else (condition,)
        for part in parts:
            if isinstance(part, Elapsed):
                yield part


def describe_violation(violation: Fact | Rule, stage: Stage, scene: Scene) -> str:
    """Return what was done and what the stage expects, in one line, as for a record's cause."""
    act = violation.cause if isinstance(violation, Rule) else describe_act(violation, scene)
    return f"{act}; {describe_expected(stage)}"


def describe_expected(stage: Stage) -> str:
    """Return what the stage expects, to follow an act: ``"expected: press the button"``."""
    words = plain_subgoal(stage)
    return f"expected: {_PLAINER_SUBGOALS.get(words, words)}"


def describe_act(fact: Fact, scene: Scene) -> str:
    """Return the act that makes a fact hold, in the past tense."""
    place = describe_object(fact.place, scene) if fact.place else ""
    return fact.traits.past.format(subject=describe_object(fact.subject, scene), place=place)


def describe_object(name: str, scene: Scene) -> str:
    """Return words for an object, or its name if the scene does not have it.

    ``cube_red`` -> *the red cube*, ``target`` -> *the target*, ``container_2`` -> *the container
    over the blue cube*, or *an empty container*.
    """
    try:
        item = scene[name]
    except KeyError:
        return name
    if item.kind != "container":
        noun = item.kind.removeprefix("hidden_")
        return f"the {item.color} {noun}" if item.color else f"the {item.kind}"
    hidden = scene.hidden_in(name)
    if hidden is None:
        return "an empty container"
    return f"the container over the {hidden.color} cube"


def plain_subgoal(stage: Stage) -> str:
    """Return the stage's simple subgoal: its words without the slot for a pixel."""
    return stage.subgoal.replace("{at} ", "").replace(" {at}", "")
