"""Stages and events give a verdict, without a simulator."""

from roboirg.judging.events import Event, changes
from roboirg.judging.judge import Judge, Status, plain_subgoal

__all__ = ["Event", "Judge", "Status", "changes", "plain_subgoal"]
