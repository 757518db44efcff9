"""What the end of an episode looks like that broke no rule: what was done instead, or how far."""

from __future__ import annotations

from collections.abc import Iterator

from roboirg.core.conditions import LASTING_KINDS, Elapsed, Fact, Rule, facts_of
from roboirg.judging.episode_replay import GRIPS, EpisodeReplay, FactInterval
from roboirg.judging.fact_history import FactHistory
from roboirg.judging.failure_attribution import FailureAttribution, FailureName
from roboirg.judging.grounding_errors import RELEASES, classify_grounding_error
from roboirg.judging.judge import describe_object
from roboirg.judging.release_errors import describe_missed_grasp, describe_release, expected_action

ATTENDED = ("hovering",)
"""Facts that say that the hand is where a press is due."""
AT_REST = Fact("still", "robot")
REST_STEPS = 100
"""A robot that has been at rest for so many control steps, five seconds, at the end has stopped."""
TOUCHES = ("reached", "held", "picked", "lifted", "pressed")


def describe_end_state(trace: EpisodeReplay) -> FailureAttribution:
    """How the end of an episode reads.

    | the end | is |
    | --- | --- |
    | something is in the hand, or done, that is not due | as `classify_grounding_error` says |
    | what was to be carried is not in the hand | ``dropped`` or ``misplaced`` |
    | what was to be picked was reached, or held, and is not in the hand | ``missed_grasp`` |
    | it stopped where a shorter task would have ended | ``wrong_count`` |
    | no stage was completed, and nothing that is due was reached | ``nothing_reached`` |
    | otherwise | ``out_of_time`` |
    """
    wanted = trace.unmet()
    instead, held = _instead(trace, wanted), _in_hand(trace, wanted)
    if held is not None:
        return instead or _stopped_short(trace) or held
    return (
        instead
        or _let_go(trace, wanted)
        or describe_missed_grasp(trace, wanted)
        or _stopped_short(trace)
        or _nothing(trace, wanted)
    )


def _instead(trace: EpisodeReplay, wanted: tuple[Fact, ...]) -> FailureAttribution | None:
    """The last thing that was done and was not due, if it still stands."""
    for spell in reversed(list(_standing(trace))):
        name = spell.fact.subject
        if name in {fact.subject for fact in wanted}:
            failure = _unfit(trace, name) if spell.fact.kind in GRIPS else None
        else:
            failure = _unfit(trace, name) or _mistake(trace, spell.fact, wanted)
        if failure is not None:
            thing = describe_object(name, trace.episode.scene)
            words = f"{_VERBS[spell.fact.kind]} {thing} {expected_action(trace)}"
            return FailureAttribution.of(failure, name, spell.begin, words)
    return None


_VERBS = {
    "picked": "picked up",
    "lifted": "lifted",
    "held": "took hold of",
    "placed": "placed",
    "pressed": "pressed",
}


def _standing(trace: EpisodeReplay) -> Iterator[FactInterval]:
    """Acts that have not been undone: what is in the hand, and what was done since the last stage.

    A container that was lifted too early counts even when it has been put down again, and a press
    where another button is due.
    """
    later = {fact for stage in trace.stages[trace.due + 1 :] for fact in facts_of(stage.expects)}
    presses = any(f.kind == "pressed" for f in facts_of(trace.stages[trace.due].expects))
    picked = {spell.fact.subject for spell in trace.begun("picked", after=trace.due_since)}
    for spell in trace.begun(*_VERBS, after=trace.turn):
        kind, fresh = spell.fact.kind, spell.begin > trace.due_since
        if (
            (kind in GRIPS and spell.end is None)
            or (kind == "lifted" and fresh and spell.fact in later)
            or (kind == "pressed" and fresh and presses)
            # Without a pick it was there before and has only been touched.
            or (kind == "placed" and fresh and spell.end is None and spell.fact.subject in picked)
        ):
            yield spell


def _mistake(trace: EpisodeReplay, fact: Fact, wanted: tuple[Fact, ...]) -> FailureName | None:
    """What an act is that is not due; taking hold of a thing is what lifting it would be."""
    if fact in wanted:
        return None
    if fact.kind == "held":
        kind = trace.episode.scene[fact.subject].kind
        fact = Fact("lifted" if kind == "container" else "picked", fact.subject)
    return classify_grounding_error(fact, trace.stages, trace.due)


def _unfit(trace: EpisodeReplay, name: str) -> FailureName | None:
    """Which rule a thing would break for good where it is due, or will be."""
    ahead = trace.stages[trace.due :]
    expected = {fact for stage in ahead for fact in facts_of(stage.expects)}
    there = {f for f in expected if f.subject == name and f.kind in LASTING_KINDS}
    if not there:
        return None
    history = FactHistory()
    history.follow(0, trace.facts[-1] | there)
    rules = (one for stage in ahead for one in stage.forbids if isinstance(one, Rule))
    return next((rule.failure for rule in rules if _forbids(rule, there, history)), None)


def _forbids(rule: Rule, there: set[Fact], history: FactHistory) -> bool:
    least = getattr(rule.condition, "least", 1)
    return bool(least and there & set(facts_of(rule)) and history.holds(rule.condition))


def _in_hand(trace: EpisodeReplay, wanted: tuple[Fact, ...]) -> FailureAttribution | None:
    now = trace.facts[-1]
    names = {fact.subject for fact in wanted}
    held = sorted(fact.subject for fact in now if fact.kind in GRIPS and fact.subject in names)
    if not held:
        return None
    thing = describe_object(held[0], trace.episode.scene)
    words = f"time was up with {thing} in the hand {expected_action(trace)}"
    return FailureAttribution.of("out_of_time", held[0], trace.end, words)


def _let_go(trace: EpisodeReplay, wanted: tuple[Fact, ...]) -> FailureAttribution | None:
    """Something that was picked, and was to be carried or let go elsewhere, is not in the hand."""
    if any(fact.kind in ("picked", "lifted") for fact in wanted):
        return None
    names = {fact.subject for fact in wanted}
    grips = [
        s for s in trace.begun("picked", "lifted", after=trace.turn) if s.fact.subject in names
    ]
    if not grips:
        return None
    last = max(grips, key=lambda spell: spell.begin)
    rests = trace.begun("lying", "put_down", after=last.begin)
    step = next((s.begin for s in rests if s.fact.subject == last.fact.subject), last.end)
    return describe_release(trace, last, trace.end if step is None else step)


def _stopped_short(trace: EpisodeReplay) -> FailureAttribution | None:
    """It stopped where a shorter task of the same sort would have ended.

    That is where the last stage asks to leave everything alone for so long, and so it was; or
    where what was done last is of the sort that the task ends with, and the robot is at rest.
    """
    kinds = [{fact.kind for fact in facts_of(stage.expects)} for stage in trace.stages]
    done = [some for some in kinds[: trace.due] if not some <= RELEASES]
    last, since = trace.stages[-1].expects, None
    if done and isinstance(last, Elapsed):
        touches = (spell for spell in trace.spells if spell.fact.kind in TOUCHES)
        touched = max((trace.end if s.end is None else s.end for s in touches), default=0)
        since = touched if trace.end - touched >= last.least else None
    elif done and done[-1] == kinds[-1]:
        rests = (s for s in trace.spells if s.fact == AT_REST and s.end is None)
        since = next((s.begin for s in rests if trace.end - s.begin >= REST_STEPS), None)
    if since is None:
        return None
    return FailureAttribution.of(
        "wrong_count", None, since, f"came to rest {expected_action(trace)}"
    )


def _nothing(trace: EpisodeReplay, wanted: tuple[Fact, ...]) -> FailureAttribution:
    attended = {fact.subject for fact in wanted} | {fact.place for fact in wanted}
    tried = any(
        spell.fact.place in attended
        for spell in trace.spells
        if spell.fact.kind in ATTENDED and (spell.end is None or spell.end > trace.turn)
    )
    if trace.due == 0 and wanted and not tried:
        words = f"reached nothing that was due, {expected_action(trace).removeprefix('while ')}"
        return FailureAttribution.of("nothing_reached", None, trace.end, words)
    return FailureAttribution.of(
        "out_of_time", None, trace.end, f"time was up {expected_action(trace)}"
    )
