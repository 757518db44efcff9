"""Stages and events give a verdict, without a simulator, and say why an episode failed."""

from roboirg.judging.attribution import attribute
from roboirg.judging.events import Event, changes
from roboirg.judging.failure_attribution import EXECUTION, GROUNDING, Finding
from roboirg.judging.judge import Judge, Status, plain_subgoal

__all__ = [
    "EXECUTION",
    "GROUNDING",
    "Event",
    "Finding",
    "Judge",
    "Status",
    "attribute",
    "changes",
    "plain_subgoal",
]
