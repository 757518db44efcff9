"""A policy served as the RoboMME challenge wants one."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from roboirg.core.observations import Observation
from roboirg.policies.base import Policy
from roboirg.policies.protocols.challenge import FIELDS
from roboirg.policies.serving.service import Answer, MakePolicy, Message, Service, act, finish


class ChallengeService(Service):
    """Answers `reset`, and anything else with actions."""

    def __init__(self, make: MakePolicy) -> None:
        super().__init__(make)
        self._policy: Policy | None = None

    def open(self) -> Answer:
        """The same for all connections."""
        return self._answer

    def _answer(self, message: Message) -> dict[str, Any]:
        if message.get("reset"):
            finish(self._policy)
            self._policy = None
            return {"reset_finished": True}
        moments = _moments(message)
        if message.get("is_first_step") or self._policy is None:
            self._policy = self._make()
            self._policy.reset(moments[-1]["instruction"], _demonstration(moments))
            moments = moments[-1:]
            moments[-1]["history"] = ()
        else:
            moments[-1]["history"] = tuple(cast("Observation", dict(moment)) for moment in moments)
        actions, _ = act(self._policy, moments[-1])
        return {"actions": actions}


def _moments(message: Message) -> list[Observation]:
    """The observations in a request.

    Raises:
        ValueError: a list is missing, or they differ in length.
    """
    goals = message.get("task_goal")
    if not isinstance(goals, list) or not goals or not isinstance(goals[0], str):
        raise ValueError("'task_goal' has to be a list of texts.")
    lists = {field: message.get(name) for name, field in FIELDS.items()}
    lengths = {len(held) if isinstance(held, list) else 0 for held in lists.values()}
    if len(lengths) > 1 or 0 in lengths:
        raise ValueError(f"{', '.join(FIELDS)} have to be lists of the same length, at least 1.")
    found: list[Any] = [
        {**dict(zip(lists, values, strict=True)), "instruction": goals[0]}
        for values in zip(*(held or () for held in lists.values()), strict=True)
    ]
    return found


def _demonstration(moments: list[Observation]) -> dict[str, Any]:
    """All but the last moment."""
    return {
        field: np.stack([moment[field] for moment in moments])[:-1]  # type: ignore[literal-required]
        for field in FIELDS.values()
    }
