"""Judge episodes from facts, without a simulator, and attribute failures."""

from roboirg.judging.declared_intent import DeclaredIntent
from roboirg.judging.episode_replay import Event, changes
from roboirg.judging.failure_analysis import attribute_failure
from roboirg.judging.failure_attribution import FailureAttribution
from roboirg.judging.judge import Judge, Status, plain_subgoal
from roboirg.judging.subgoal_verdicts import SUBGOAL_VERDICTS, judge_subgoal

__all__ = [
    "SUBGOAL_VERDICTS",
    "DeclaredIntent",
    "Event",
    "FailureAttribution",
    "Judge",
    "Status",
    "attribute_failure",
    "changes",
    "judge_subgoal",
    "plain_subgoal",
]
