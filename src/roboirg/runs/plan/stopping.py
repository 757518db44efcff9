"""When a run may stop: what its results so far say about the sides that its plan compares.

Everything here is a function of the plan's jobs and the stored results. So the runner, tables, the
page and a resumed run find the same, whatever order episodes finished in.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import msgspec
import numpy as np

from roboirg.core.arms import TOLD
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions, options_label
from roboirg.language.settings import EXPLICIT
from roboirg.records.record import Job, Summary
from roboirg.records.record_codec import RecordKey, identity_key
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.plan_sections import StopRule
from roboirg.stats.anytime import (
    PairedScenes,
    SequentialDecision,
    decide,
    mean_bounds,
    mean_difference,
    scene_weights,
)
from roboirg.stats.rates import anytime_text, points
from roboirg.util.short_hash import short_hash

_SIDES = 2
_POINTS = 100


class PlanScene(NamedTuple):
    """A scene of the plan's split."""

    task: str
    episode: int


class Side(NamedTuple):
    """What is compared: a policy with the options of an instruction."""

    policy: str
    options: InstructionOptions


class Contrast(NamedTuple):
    """Two sides that are compared scene by scene: two policies, or an instruction with explicit."""

    first: Side
    second: Side

    @property
    def is_gap(self) -> bool:
        """Whether it compares two instructions of one policy."""
        return self.first.policy == self.second.policy

    @property
    def name(self) -> str:
        """What is compared, in words: ``direct, mine to pi0`` or ``mine, direct to explicit``."""
        label = options_label(self.first.options)
        if self.is_gap:
            return f"{self.first.policy}, {label} to {options_label(self.second.options)}"
        return f"{label}, {self.first.policy} to {self.second.policy}"


class ComparedSides(NamedTuple):
    """A comparison of a run, and what was found.

    Attributes:
        contrast: the two sides.
        pairs: their results by scene.
        decision: what these say.
        rule: when it is decided.
    """

    contrast: Contrast
    pairs: PairedScenes
    decision: SequentialDecision
    rule: StopRule

    @property
    def name(self) -> str:
        return self.contrast.name

    @property
    def planned(self) -> int:
        """In how many scenes both sides are planned."""
        return self.pairs.planned

    @property
    def is_open(self) -> bool:
        return self.decision.finding == "open"

    @property
    def sentence(self) -> str:
        """What was found: ``direct, mine to pi0: mine is better, +14.3 points, p = 0.021 …``.

        If not all scenes were needed, how many counted follows, and where the difference over all
        of them lies.
        """
        seen = self.pairs.first(self.decision.places)
        better = self.contrast.first
        if self.decision.finding == "second":
            better = self.contrast.second
        better_name = options_label(better.options) if self.contrast.is_gap else better.policy
        is_better = f"{better_name} is better"
        findings = {
            "first": is_better,
            "second": is_better,
            "within": f"they differ by less than {self.rule.margin:g} points",
            "undecided": "not decided",
            "open": "not decided yet",
        }
        finding = findings[self.decision.finding]
        gap = points(mean_difference(seen), 1)
        figures = anytime_text(self.decision.p_holm, seen, mean_bounds(seen))
        return f"{self.name}: {finding}, {gap} points, {figures}."


Trials = Mapping[Side, Mapping[PlanScene, Sequence[Job]]]
"""The jobs of each side in each scene, one for each policy seed."""


def scene_order(scenes: Iterable[PlanScene], split: str) -> list[PlanScene]:
    """Return scenes in the order in which they are looked at.

    It is random, and the same for all plans and policies: that of a hash of the scene's name.
    """

    def key(scene: PlanScene) -> str:
        return short_hash(f"order of scenes/{split}/{scene.task}/{scene.episode}")

    return sorted(scenes, key=lambda scene: (key(scene), scene))


@dataclass(frozen=True)
class Stopping:
    """What is compared in a run, and what its results say so far.

    Attributes:
        rule: when a comparison is closed.
        plan: that has the rule.
        trials: planned jobs by side and scene; of a side that is stored already, its results.
        results: the newest result of each job.
        contrasts: what is compared.
    """

    rule: StopRule
    plan: Plan
    trials: Trials
    results: Mapping[RecordKey, Summary]
    contrasts: Sequence[Contrast]

    @cached_property
    def order(self) -> list[PlanScene]:
        """The scenes of all sides that are compared, in the order in which they are looked at."""
        scenes: set[PlanScene] = set()
        for contrast in self.contrasts:
            for side in contrast:
                scenes.update(self.trials[side])
        return scene_order(scenes, self.plan.split)

    @cached_property
    def places(self) -> Mapping[PlanScene, int]:
        """The place of each scene in the order, from 0."""
        return {scene: place for place, scene in enumerate(self.order)}

    @cached_property
    def pairs(self) -> list[PairedScenes]:
        """Of each contrast, the differences in the scenes that are known."""
        return [self._paired(contrast) for contrast in self.contrasts]

    @cached_property
    def decisions(self) -> list[SequentialDecision]:
        """What was found of each contrast."""
        return decide(self.pairs, self.rule.alpha, self.rule.margin / _POINTS)

    @property
    def compared(self) -> list[ComparedSides]:
        """Every comparison with what was found of it."""
        found = []
        for contrast, pairs, decision in zip(
            self.contrasts, self.pairs, self.decisions, strict=True
        ):
            found.append(ComparedSides(contrast, pairs, decision, self.rule))
        return found

    @cached_property
    def _needed(self) -> frozenset[RecordKey]:
        """The jobs of the scenes that both sides of a contrast have, up to its decision."""
        needed: set[RecordKey] = set()
        for contrast, decision in zip(self.contrasts, self.decisions, strict=True):
            places = len(self.order) if decision.finding == "open" else decision.places
            first = self.trials[contrast.first]
            second = self.trials[contrast.second]
            for scene in self.order[:places]:
                if scene in first and scene in second:
                    needed.update(identity_key(job) for job in first[scene])
                    needed.update(identity_key(job) for job in second[scene])
        return frozenset(needed)

    def needs(self, job: Job) -> bool:
        """Return whether a job belongs to what is compared, up to where it was decided.

        The results of others count nowhere, even if they were played: which episodes were, and how
        many, would depend on which ended first.
        """
        return identity_key(job) in self._needed

    def _paired(self, contrast: Contrast) -> PairedScenes:
        """Return the differences of two sides in the order of scenes, up to the first unknown."""
        first = self.trials[contrast.first]
        second = self.trials[contrast.second]
        shared = first.keys() & second.keys()
        weight_of = scene_weights(Counter(scene.task for scene in shared))
        weights = np.zeros(len(self.order))
        for scene in shared:
            weights[self.places[scene]] = weight_of[scene.task]

        differences = []
        for scene in self.order:
            difference: float | None = np.nan
            if scene in shared:
                difference = self._difference(first[scene], second[scene])
            if difference is None:
                break
            differences.append(difference)
        return PairedScenes(np.array(differences, dtype=np.float64), weights)

    def _difference(self, first: Sequence[Job], second: Sequence[Job]) -> float | None:
        """Return by how much the success of two sides differs in a scene, -1 to 1.

        NaN if one ended in an error that stays; None if it is not known yet.
        """
        first_rate = self._rate(first)
        second_rate = self._rate(second)
        if first_rate is None or second_rate is None:
            return None
        return first_rate - second_rate

    def _rate(self, jobs: Sequence[Job]) -> float | None:
        """Return the success of jobs, the mean over policy seeds; NaN or None as `_difference`."""
        verdicts = []
        for job in jobs:
            result = self.results.get(identity_key(job))
            if result is None:
                return None
            # The errors of a stored policy stay, as this run does not play it.
            if self.plan.attempts.has_left(result) and result.policy != self.rule.against:
                return None
            is_error = result.outcome == "error"
            verdicts.append(np.nan if is_error else float(result.outcome == "success"))
        return float(np.mean(verdicts))


def find_stopping(plan: Plan, jobs: Iterable[Job], results: Iterable[Summary]) -> Stopping:
    """Return what a run's results say about the sides that its plan compares.

    Args:
        plan: with a stop rule.
        jobs: of the plan.
        results: the newest of each job; and those of the policy that is stored already, if the
            rule names one.

    Raises:
        InvalidValueError: there is no rule, nothing to compare, or more than two policies.
    """
    rule = plan.stop
    if rule is None:
        raise InvalidValueError("The plan has no stop rule.")
    newest = {identity_key(result): result for result in results}
    compared: list[Job] = [*jobs]
    planned = {key_without_policy(job) for job in compared}
    for result in newest.values():
        # The folder may hold results of an earlier plan, too, of another split or seed.
        if result.policy == rule.against and key_without_policy(result) in planned:
            compared.append(result)
    trials: defaultdict[Side, defaultdict[PlanScene, list[Job]]] = defaultdict(
        lambda: defaultdict(list)
    )
    for job in compared:
        if job.arm == TOLD:
            trials[side_of(job)][scene_of(job)].append(job)
    return Stopping(rule, plan, trials, newest, _find_contrasts(trials))


def _find_contrasts(sides: Collection[Side]) -> list[Contrast]:
    """Return each instruction of two policies, or each one of a policy to explicit.

    Raises:
        InvalidValueError: there is nothing to compare, or there are more than two policies.
    """
    policies = list(dict.fromkeys(side.policy for side in sides))
    if len(policies) > _SIDES:
        raise InvalidValueError(
            f"stop compares two policies, or the settings of one; this plan has "
            f"{len(policies)}: {', '.join(policies)}."
        )
    contrasts = []
    for side in sides:
        other = Side(policies[-1], side.options)
        if len(policies) < _SIDES:
            other = Side(side.policy, InstructionOptions(EXPLICIT))
        if side.policy == policies[0] and other != side and other in sides:
            contrasts.append(Contrast(side, other))
    if not contrasts:
        raise InvalidValueError(
            "stop has nothing to compare: it takes two policies in the same settings, or one "
            "policy in explicit and another setting."
        )
    return contrasts


def key_without_policy(job: Job) -> RecordKey:
    """Return what identifies a job but its policy: its episode, words, conditions and seed."""
    return identity_key(msgspec.structs.replace(job, policy=""))


def side_of(job: Job) -> Side:
    return Side(job.policy, job.column)


def scene_of(job: Job) -> PlanScene:
    return PlanScene(job.task, job.episode)
