"""Hands and planners that learned: what names subgoals, and what follows them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.policies import Demonstration, Observation
from roboirg.extension.sight import LOOK_EVERY
from roboirg_learn.policy.learned_policy import LearnedPolicy, tool_of
from roboirg_learn.policy.moves import LEAVE
from roboirg_learn.policy.planner_history import (
    RECENT,
    PlannedNumbers,
    PlannerHistory,
    asked_for,
    recent_looks,
)
from roboirg_learn.policy.policy_plan import CHOOSES
from roboirg_learn.policy.subgoals import asked_numbers

if TYPE_CHECKING:
    from roboirg_learn.policy.policy_model import PolicyModel, SeenEpisode


class SubgoalNamer:
    """Names the next subgoal after each look of one episode.

    Args:
        model: whose planner names it.
        seen: the episode.
    """

    def __init__(self, model: PolicyModel, seen: SeenEpisode) -> None:
        self._model, self._seen = model, seen
        self._history = PlannerHistory(len(model.forms), chooses=model.memory == CHOOSES)
        self._last: tuple[int, int | None, str] | None = None

    def next(self, goal: NDArray[np.float32]) -> str:
        """Return the subgoal; its point stays as long as the same thing is meant.

        Args:
            goal: as `PolicyModel.understand` returns it.
        """
        if self._model.planner is None:
            raise RuntimeError("This policy has no planner.")
        history, look = self._history, self._seen.looks - 1
        planned = PlannedNumbers(
            history.context(look)[None],
            history.kept(self._seen.video_looks, look)[None],
            np.full((1, RECENT), -1),
        )
        chosen = self._seen.choose(self._model.planner, goal, planned)
        history.name(chosen.kind, look)
        recent = recent_looks(look)
        history.choose(recent[place] for place in chosen.keys if recent[place] >= 0)
        if self._last is None or self._last[:2] != chosen[:2]:
            form = self._model.forms[chosen.kind]
            point = None if chosen.thing is None else self._seen.point(chosen.thing)
            self._last = (*chosen[:2], form.at(point))
        return self._last[2]


class LearnedHands(LearnedPolicy):
    """Follows subgoals, those of any planner; without one, those of its own.

    Attributes:
        subgoal: the one it follows.
    """

    subgoal: str | None = None
    _asked: NDArray[np.float32] | None = None
    _namer: SubgoalNamer | None = None

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        super().reset(instruction, demonstration)
        self.subgoal, self._asked = None, None
        self._namer = SubgoalNamer(self.model, self.seen)

    def follow(self, subgoal: str) -> None:
        """Set the subgoal; words of no known form change nothing."""
        self._namer = None
        self._take(subgoal)

    def act(self, observation: Observation) -> NDArray[np.float64]:
        """Return the next waypoint (1, 7); without a subgoal the tool stays where it is."""
        seen = self.watch(observation)
        if self._namer is not None:
            self._take(self._namer.next(self.understand()))
        if self._asked is None:
            return np.append(observation["end_effector"], LEAVE)[None]
        nothing = np.zeros(self.model.vocabulary.goal_size, np.float32)
        chosen = seen.decide(nothing, tool_of(observation), asked_for([self._asked]))
        return chosen[None]

    def _take(self, subgoal: str) -> None:
        found = asked_numbers(subgoal, self.model.sight)
        if found is not None:
            self.subgoal, self._asked = subgoal, found


class LearnedPlanner:
    """Names subgoals from words, pictures and what it named before, for hands of any kind.

    Args:
        model: whose planner names them.
        version: of the file that holds it.
    """

    cameras = ("front",)
    demonstration_frames = LOOK_EVERY
    observe_every = LOOK_EVERY

    def __init__(self, model: PolicyModel, version: str) -> None:
        self.version = version
        self._eyes = LearnedPolicy(model, version)
        self.trained_tasks = self._eyes.trained_tasks

    @property
    def metadata(self) -> dict[str, Any]:
        return self._eyes.metadata

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        self._eyes.reset(instruction, demonstration)
        self._namer = SubgoalNamer(self._eyes.model, self._eyes.seen)

    def hear(self, text: str, step: int) -> None:
        self._eyes.hear(text, step)

    def plan(self, observation: Observation, step: int) -> str | None:  # noqa: ARG002
        """Return the subgoal from now on."""
        self._eyes.watch(observation)
        return self._namer.next(self._eyes.understand())
