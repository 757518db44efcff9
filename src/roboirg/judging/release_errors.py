"""Releases beside the place, failed grasps, and what they excuse.

An act that comes too early may be right after all: a policy that has let its cube fall beside the
target and goes on has counted well. So the episode is judged a second time as if each release had
been where it was due; where the act is then allowed, the first release is to blame. Likewise an act
after a grasp that failed, if nothing but what needs that grasp was left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from roboirg.core.conditions import LASTING_KINDS, Fact, facts_of
from roboirg.judging.episode_replay import EpisodeReplay, FactInterval
from roboirg.judging.failure_attribution import FailureAttribution
from roboirg.judging.judge import Judge, Status, describe_object, plain_subgoal

PLACINGS = ("placed", "binned")


class MisplacedRelease(NamedTuple):
    """Something that was picked came to lie elsewhere than where it was due.

    Attributes:
        missing: the fact that was due and would have begun.
        grip: the last spell of its being picked.
        begin: the step from which it lay there.
        until: the step at which it was picked again; None if it was not.
    """

    missing: Fact
    grip: FactInterval
    begin: int
    until: int | None


def find_excusing_release(trace: EpisodeReplay, act: Fact) -> FailureAttribution | None:
    """The failed execution without which an act would not have come too early, if there is one."""
    due = trace.due
    later = [
        index
        for index in range(due + 1, len(trace.stages))
        if act in facts_of(trace.stages[index].expects)
    ]
    if not later:
        return None
    slips = list(_slips(trace))
    if slips and _allowed(trace, slips):
        return describe_release(trace, slips[0].grip, slips[0].begin)
    expects = trace.stages[due].expects
    if [stage.expects for stage in trace.stages[due : later[0]]].count(expects) == 1:
        return describe_missed_grasp(trace, facts_of(expects))
    return None


def describe_missed_grasp(
    trace: EpisodeReplay, wanted: tuple[Fact, ...]
) -> FailureAttribution | None:
    """The last attempt to take hold of something since the present stage is due."""
    subjects = {fact.subject for fact in wanted if fact.kind in ("picked", "lifted")}
    tries = trace.begun("reached", "held", after=trace.due_since)
    spell = max(
        (spell for spell in tries if spell.fact.subject in subjects),
        key=lambda spell: spell.begin,
        default=None,
    )
    if spell is None:
        return None
    name = spell.fact.subject
    words = f"reached {describe_object(name, trace.episode.scene)} without lifting it"
    return FailureAttribution.of(
        "missed_grasp", name, spell.begin, f"{words} {expected_action(trace)}"
    )


def describe_release(trace: EpisodeReplay, grip: FactInterval, step: int) -> FailureAttribution:
    """What was picked has been let go elsewhere than where it was due.

    Args:
        trace: of the episode.
        grip: the last spell of its being picked or lifted, which is over.
        step: when it lay there.
    """
    name = grip.fact.subject
    thing = describe_object(name, trace.episode.scene)
    due = expected_action(trace, trace.dues[step])
    if grip.end is not None and Fact("held", name) in trace.facts[grip.end]:
        return FailureAttribution.of(
            "misplaced", name, step, f"put {thing} down outside its place {due}"
        )
    return FailureAttribution.of("dropped", name, step, f"dropped {thing} {due}")


def expected_action(trace: EpisodeReplay, due: int | None = None) -> str:
    """What was due, in words."""
    stage = trace.stages[max(trace.due if due is None else due, 0)]
    return f"while due: {plain_subgoal(stage)}"


def _slips(trace: EpisodeReplay) -> Iterator[MisplacedRelease]:
    picks = list(trace.begun("picked", after=trace.turn))
    for spell in trace.begun("lying", after=trace.turn):
        name, begin = spell.fact.subject, spell.begin
        own = [pick for pick in picks if pick.fact.subject == name]
        grips = [pick for pick in own if pick.end is not None and pick.end <= begin]
        again = min((pick.begin for pick in own if pick.begin > begin), default=None)
        missing = _missing(trace, name, begin)
        if grips and missing is not None and not _came(trace, missing, begin, again):
            yield MisplacedRelease(missing, max(grips, key=lambda pick: pick.begin), begin, again)


def _missing(trace: EpisodeReplay, name: str, step: int) -> Fact | None:
    """Where a thing was due at a step, if it was."""
    due = facts_of(trace.stages[max(trace.dues[step], 0)].expects)
    return next((f for f in due if f.kind in PLACINGS and f.subject == name), None)


def _came(trace: EpisodeReplay, fact: Fact, begin: int, until: int | None) -> bool:
    """Whether a fact held at any step from one to another."""
    return any(fact in facts for facts in trace.facts[begin:until])


def _allowed(trace: EpisodeReplay, slips: list[MisplacedRelease]) -> bool:
    """Whether no rule is broken if each release was where it was due."""
    judge = Judge((*trace.episode.demonstration, *trace.stages), trace.episode.scene)
    for step, facts in enumerate(trace.facts):
        credit = {slip.missing for slip in slips if _holds(slip, step)}
        judge.update(step, facts | credit if credit else facts)
    return judge.status is not Status.FAILURE


def _holds(slip: MisplacedRelease, step: int) -> bool:
    lasts = slip.until is None or slip.missing.kind in LASTING_KINDS
    return slip.begin <= step and (lasts or step < (slip.until or 0))
