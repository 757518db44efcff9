"""What an environment returned in the scene that was played last, by the actions before."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roboirg.core.episode import Stage
from roboirg.core.subgoal_text import Point

MOST_BYTES = 128 * 2**20
"""Of what is kept of a scene; what follows later is simulated each time."""
MOMENT_BYTES = 2000
"""Of a moment without its arrays, about."""

EndState = tuple[NDArray[np.float64], str]
"""The state of a world in numbers, (m,), and as a SHA-256."""

StepResult = tuple[dict[str, Any], float, bool, bool, dict[str, Any]]


@dataclass
class Moment:
    """What the environment returned after some actions, and what it was asked then.

    Attributes:
        result: of `step_chunk`; after a reset, there is no reward yet.
        executed_actions: since the reset.
        stage: that is due.
        objects: found at points of the front picture.
        end: the state in numbers and as a hash, if it was read.
        following: the moments after further actions, by the bytes of these.
    """

    result: StepResult
    executed_actions: int
    stage: Stage | None
    objects: dict[Point, frozenset[str] | None] = field(default_factory=dict)
    end: EndState | None = None
    following: dict[bytes, Moment] = field(default_factory=dict)

    def in_words(self, words: str) -> StepResult:
        """Return the result with another instruction, which was heard at the reset."""
        observation = {**self.result[0], "instruction": words}
        if "history" in observation:
            past = observation["history"]
            observation["history"] = tuple({**one, "instruction": words} for one in past)
        return (observation, *self.result[1:])


class Recollection:
    """All moments of the scene that was played last."""

    def __init__(self) -> None:
        self._of: tuple[object, ...] = ()
        self._starts: dict[object, Moment] = {}
        self._bytes = 0

    def start_of(self, goal: object, *scene: object) -> Moment | None:
        """Return the moment after the reset of a scene with a goal; forgets all other scenes."""
        if scene != self._of:
            self._of, self._starts, self._bytes = scene, {}, 0
        return self._starts.get(goal)

    def keep_start(self, goal: object, moment: Moment) -> None:
        """Keep the moment after the reset of the scene with a goal."""
        self._bytes += _size(moment.result[0])
        self._starts[goal] = moment

    def keep(self, moment: Moment, before: Moment, actions: bytes) -> None:
        """Keep a moment that follows another one, if there is room."""
        self._bytes += _size(moment.result[0]) + len(actions)
        if self._bytes <= MOST_BYTES:
            before.following[actions] = moment


def _size(observation: Mapping[str, Any]) -> int:
    """Return the bytes of a moment with an observation and its history."""
    past = observation.get("history", ())
    arrays = (one for part in (observation, *past) for one in part.values())
    return MOMENT_BYTES + sum(one.nbytes for one in arrays if isinstance(one, np.ndarray))
