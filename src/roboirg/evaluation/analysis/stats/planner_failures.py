"""How an episode of a planner went wrong, from its record alone."""

from __future__ import annotations

from collections.abc import Mapping

from roboirg.core.subgoal_text import UNKNOWN_WORDS, split_point, split_steps
from roboirg.evaluation.records.record import Record, SubgoalRecord

IDLE_STEPS = 400
"""Control steps, the most that a motion takes, without a new act: the planner had stopped."""
WAITING = frozenset({"remain static", "static", "hold still"})

_OF_ATTRIBUTION = {
    "wrong_object": "wrong thing",
    "mirrored_pick": "wrong thing",
    "wrong_place": "wrong place",
    "wrong_count": "wrong count",
    "wrong_order": "wrong time",
    "wrong_time": "wrong time",
}
_OF_VERDICT = {
    "wrong_thing": "wrong thing",
    "wrong_place": "wrong place",
    "wrong_count": "wrong count",
    "lost": "wrong time",
}
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
    """Return how a planner's episode went wrong; None if it did not, or if no planner is known.

    The act that broke a rule of the task decides, as the failure analysis attributes it. Where time
    ran out instead, the last subgoals do.
    """
    if record.outcome == "success" or "planner" not in record.policy_metadata:
        return None
    if record.outcome == "error":
        return "no answer" if record.error in ("timeout", "connection") else None
    found = record.attribution
    timed_out = record.steps >= record.environment.max_steps
    if not timed_out:
        if found is None or found.kind == "undecided":
            return _last_verdict(record) or "hands"
        return _OF_ATTRIBUTION.get(found.failure, "hands")
    return _when_time_is_up(record)


def _when_time_is_up(record: Record) -> str:
    acts = [one for one in record.subgoals if not _waits(one)]
    if record.usage.get("finished"):
        return "stopped early"
    if record.usage.get("unreadable") or (record.usage.get("unparsed") and not acts):
        return "unreadable"
    last = acts[-1] if acts else None
    if last is not None and last.ended == "refused":
        return "unreadable" if last.why == UNKNOWN_WORDS else "refused"
    if last is None or record.steps - last.step > IDLE_STEPS:
        return "stopped early"
    return "went on too long" if last.ended in ("done", None) else "hands"


def _last_verdict(record: Record) -> str | None:
    wrong = [one.verdict for one in record.subgoals if one.verdict in _OF_VERDICT]
    return _OF_VERDICT[wrong[-1]] if wrong else None


def _waits(subgoal: SubgoalRecord) -> bool:
    words, _ = split_point(subgoal.text)
    return split_steps(words)[0] in WAITING
