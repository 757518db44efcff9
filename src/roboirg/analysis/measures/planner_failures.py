"""How an episode of a planner went wrong, from its record alone."""

from __future__ import annotations

from collections.abc import Mapping

from roboirg.core.subgoal_text import UNKNOWN_WORDS, split_point, split_steps
from roboirg.records.record import Record, SubgoalRecord

IDLE_STEPS = 400
"""Control steps, the most that a motion takes, without a new act: the planner had stopped."""
WAITING = frozenset({"remain static", "static", "hold still"})

_BY_ATTRIBUTION = {
    "wrong_object": "wrong thing",
    "mirrored_pick": "wrong thing",
    "wrong_place": "wrong place",
    "wrong_count": "wrong count",
    "wrong_order": "wrong time",
    "wrong_time": "wrong time",
}
"""By the name of the failure in the failure analysis; by any other name it was the hands."""
_BY_VERDICT = {
    "wrong_thing": "wrong thing",
    "wrong_place": "wrong place",
    "wrong_count": "wrong count",
    "lost": "wrong time",
}
"""By the verdict of a subgoal that was not right."""
PLANNER_FAILURES: Mapping[str, str] = {
    "no answer": "its model was silent, late or out of reach; such episodes are errors, left out "
    "of the rates",
    "unreadable": "the last replies of its model were not subgoals of a known form",
    "refused": "its last subgoals fitted nothing or several things",
    "wrong thing": "it had another thing handled, or one on the other side",
    "wrong place": "it had the right thing put elsewhere",
    "wrong count": "it had the task ended with another number, or something done once too often",
    "wrong time": "it had the right thing done at another time or in another order",
    "stopped early": f"it reported that all was done, or named no new act for {IDLE_STEPS} steps",
    "went on too long": "it was still having things done when time was up",
    "hands": "its last subgoal came to nothing, or was due and not completed",
}
"""What each failure means, in the order in which they are shown."""


def planner_failure(record: Record) -> str | None:
    """Return why an episode of a planner failed, such as ``wrong thing``.

    A planner names subgoals to a policy. The failure is one of `PLANNER_FAILURES`; None for a
    success, and without a planner. The act that broke a rule of the task decides, as the failure
    analysis attributes it. Where time ran out instead, the last subgoals do.
    """
    if record.outcome == "success" or "planner" not in record.policy_metadata:
        return None
    if record.outcome == "error":
        return "no answer" if record.error in ("timeout", "connection") else None
    if record.steps >= record.environment.max_steps:
        return _failure_at_time_limit(record)
    attribution = record.attribution
    if attribution is None or attribution.kind == "undecided":
        return _last_wrong_subgoal(record) or "hands"
    return _BY_ATTRIBUTION.get(attribution.failure, "hands")


def _failure_at_time_limit(record: Record) -> str:
    """Return why an episode failed that was played until its time was up: ``stopped early``.

    It is one of `PLANNER_FAILURES`, and follows from what the planner last asked for.
    """
    acts = [subgoal for subgoal in record.subgoals if not _is_waiting(subgoal)]
    usage = record.usage
    if usage.get("finished"):
        return "stopped early"
    if usage.get("unreadable") or (usage.get("unparsed") and not acts):
        return "unreadable"
    if not acts:
        return "stopped early"
    return _failure_in_last_act(acts[-1], record.steps)


def _failure_in_last_act(act: SubgoalRecord, steps: int) -> str:
    """Return why an episode failed when time was up, from the last act that the planner asked for.

    Args:
        act: the last subgoal that asks for an act.
        steps: length of the episode, in control steps.
    """
    if act.ended == "refused":
        return "unreadable" if act.why == UNKNOWN_WORDS else "refused"
    if steps - act.step > IDLE_STEPS:
        return "stopped early"
    if act.ended in ("done", None):
        return "went on too long"
    return "hands"


def _last_wrong_subgoal(record: Record) -> str | None:
    """Return the failure of the last subgoal that was not right; None if there was none."""
    for subgoal in reversed(record.subgoals):
        if subgoal.verdict in _BY_VERDICT:
            return _BY_VERDICT[subgoal.verdict]
    return None


def _is_waiting(subgoal: SubgoalRecord) -> bool:
    """Return whether a subgoal asks for no act, such as ``remain static``."""
    words, _ = split_point(subgoal.text)
    return split_steps(words)[0] in WAITING
