"""Results that may be averaged: one policy under one set of conditions and versions.

Results under other conditions, or of other versions of the policy, the language or the
environment, are another policy run and never averaged with the rest.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from roboirg.core.arms import TOLD
from roboirg.core.environment_options import ENVIRONMENT_OPTIONS, EnvironmentOptions
from roboirg.core.subgoal_text import BETWEEN_VERSIONS, SCRIPTED_HANDS
from roboirg.core.versions import Makeup, Versions
from roboirg.core.word_pools import words_label
from roboirg.records.record import Job, Summary

CONDITIONS = ("split", *ENVIRONMENT_OPTIONS, "wordings", "arm")
"""The names of all conditions."""

PRIVILEGED_MARK = " (privileged)"
"""Mark of policies that read the simulator's state."""
UNTIL_DECIDED_MARK = " (until decided)"
"""Mark of runs that stopped when what they compare was decided."""
HANDS_MARK = f" ({SCRIPTED_HANDS})"
"""Mark of planners whose hands read it, while they see pictures and words."""

_read_conditions = operator.attrgetter("split", "environment", "options.wordings", "arm")


class EvalConditions(NamedTuple):
    """The conditions under which a policy plays."""

    split: str
    environment: EnvironmentOptions = EnvironmentOptions()
    wordings: str | None = None
    arm: str = TOLD

    @classmethod
    def of(cls, job: Job) -> EvalConditions:
        return cls._make(_read_conditions(job))

    def text(self, name: str) -> str:
        """Return the value of a condition as it is printed, such as ``900`` of ``max_steps``."""
        if name == "wordings":
            return words_label(self.wordings)
        if name in ENVIRONMENT_OPTIONS:
            return str(getattr(self.environment, name))
        return str(getattr(self, name))

    def label(self, name: str) -> str:
        """Return a condition with its value, such as ``max steps 900``."""
        if name == "wordings":
            return self.text(name)
        return f"{name.replace('_', ' ')} {self.text(name)}"


class PolicyRun(NamedTuple):
    """One policy under one set of conditions and versions.

    Attributes:
        policy: its name.
        conditions: under which it played.
        versions: unknown before it has played; the policy's has that of its server.
        run: name of the run if several runs hold the same episodes, else empty.
        is_privileged: whether the policy read the simulator's state.
        robot: the real robot of a study; None in simulation.
        findings: sentences on what its run compares, if that stops when it is decided; empty for
            other runs. Its rates are of fewer episodes, whose number depends on them, so they have
            no interval.
    """

    policy: str
    conditions: EvalConditions
    versions: Versions
    run: str = ""
    is_privileged: bool = False
    robot: str | None = None
    findings: tuple[str, ...] = ()

    @classmethod
    def of(cls, result: Summary, run: str = "") -> PolicyRun:
        return _policy_run(run, *_read_facts(result))

    @property
    def is_until_decided(self) -> bool:
        """Whether its run stops when what it compares is decided."""
        return bool(self.findings)

    @property
    def language(self) -> str:
        """The version of the language that it heard; empty before it has played."""
        return self.versions.language_version or ""

    @property
    def marked_policy(self) -> str:
        """The policy's name, marked if it is privileged."""
        return self.policy + self.mark

    @property
    def has_planner(self) -> bool:
        """Whether it has played as a planner with a policy."""
        return BETWEEN_VERSIONS in str(self.versions.policy_version)

    @property
    def mark(self) -> str:
        """The marks of a privileged policy, and of a run until decided; empty for the others."""
        mark = ""
        if self.is_privileged:
            has_scripted_hands = SCRIPTED_HANDS in str(self.versions.policy_version)
            mark = HANDS_MARK if has_scripted_hands else PRIVILEGED_MARK
        if self.is_until_decided:
            mark += UNTIL_DECIDED_MARK
        return mark


_read_facts = operator.attrgetter(
    "policy", "split", "environment", "options.wordings", "arm", "ref.makeup",
    "environment_version", "language_version", "played_version", "privileged", "robot",
)  # fmt: skip
"""What of a result its policy run is made of, in the order of `_policy_run`."""


@functools.lru_cache(maxsize=1024)
def _policy_run(
    run: str,
    policy: str,
    split: str,
    environment: EnvironmentOptions,
    wordings: str | None,
    arm: str,
    makeup: Makeup,
    environment_version: int,
    language_version: str,
    played_version: str,
    is_privileged: bool,
    robot: str | None,
) -> PolicyRun:
    """Return a policy run; the same object for all results that agree in these facts."""
    versions = Versions(
        makeup,
        environment_version=environment_version,
        language_version=language_version,
        policy_version=played_version,
    )
    conditions = EvalConditions(split, environment, wordings, arm)
    return PolicyRun(policy, conditions, versions, run, is_privileged, robot)


def labels(policy_runs: Iterable[PolicyRun]) -> dict[PolicyRun, str]:
    """Return a label for each policy run, with what distinguishes runs of the same policy.

    Privileged policies are marked, because their rates are no rates of policies.
    """
    distinct = list(dict.fromkeys(policy_runs))
    return {policy_run: _label(policy_run, distinct) + policy_run.mark for policy_run in distinct}


def _label(policy_run: PolicyRun, policy_runs: Sequence[PolicyRun]) -> str:
    """Return a label that sets a policy run apart from others: ``listener, max steps 900``.

    After the policy's name come the conditions and versions in which it differs from others.

    Args:
        policy_run: a policy under some conditions, in some versions.
        policy_runs: all that are labeled together.
    """
    parts = [policy_run.policy]
    for name in CONDITIONS:
        values = {other.conditions.text(name) for other in policy_runs}
        if len(values) > 1:
            parts.append(policy_run.conditions.label(name))
    parts += _version_labels(policy_run, policy_runs)
    if policy_run.robot is not None:
        parts.append(f"on {policy_run.robot}")
    if policy_run.run:
        parts.append(policy_run.run)
    return ", ".join(parts)


def _version_labels(policy_run: PolicyRun, policy_runs: Sequence[PolicyRun]) -> list[str]:
    """Return phrases for the versions in which a policy run differs from others.

    For example ``["language 5"]`` if another policy run heard the language's version 4.
    """
    labels_by_trait = {}
    for other in policy_runs:
        other_versions = other.versions
        if other.policy != policy_run.policy:
            # What a policy is matters only among runs of the same policy.
            other_versions = other_versions._replace(policy_version=None, makeup=())
        for mismatch in policy_run.versions.differences(other_versions):
            labels_by_trait[mismatch.what] = mismatch.label
    return [labels_by_trait[trait] for trait in sorted(labels_by_trait)]
