"""Hands and planners that learned: what names subgoals, and what follows them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.policies import Demonstration, Observation
from roboirg.extension.sight import LOOK_EVERY
from roboirg_learn.policy.learned_policy import LearnedPolicy, tool_of
from roboirg_learn.policy.moves import GRIPPER_UNCHANGED
from roboirg_learn.policy.planner_history import (
    NO_LOOK,
    RECENT,
    PlannedNumbers,
    PlannerHistory,
    recent_looks,
    requests_for_hands,
)
from roboirg_learn.policy.policy_plan import KEYFRAME_PLANNER
from roboirg_learn.policy.subgoals import encode_request

if TYPE_CHECKING:
    from roboirg_learn.policy.policy_model import NetworkChoice, PolicyModel, SeenEpisode


class SubgoalNamer:
    """Names the next subgoal after each look of one episode.

    Args:
        model: whose planner names it.
        seen: the episode.
    """

    def __init__(self, model: PolicyModel, seen: SeenEpisode) -> None:
        self._body = model.body
        self._seen = seen
        chooses = self._body.plan["memory"] == KEYFRAME_PLANNER
        self._history = PlannerHistory(len(self._body.forms), chooses=chooses)
        self._last_kind: int | None = None
        self._last_thing: int | None = None
        self._subgoal = ""

    def next(self, goal: NDArray[np.float32]) -> str:
        """Return the subgoal after the last look, in words with a point.

        While kind and thing stay the same the words do, too: the point does not follow the thing.

        Args:
            goal: as `GoalLayout.numbers` returns it.
        """
        if self._body.planner is None:
            raise RuntimeError("This policy has no planner.")
        look = self._seen.looks - 1
        chosen = self._seen.choose(self._body.planner, goal, self._planned(look))
        self._history.name(chosen.kind, look)
        # Chosen are places among the recent looks; before the first look there is none.
        recent = [recent_looks(look)[place] for place in chosen.to_keep]
        self._history.choose(number for number in recent if number >= 0)

        is_same = chosen.kind == self._last_kind and chosen.thing == self._last_thing
        if not is_same:
            self._last_kind = chosen.kind
            self._last_thing = chosen.thing
            self._subgoal = self._words(chosen)
        return self._subgoal

    def _planned(self, look: int) -> PlannedNumbers:
        """Return the planner's input at a look: what it named, and the looks that it keeps.

        `to_keep` is a label of training, so it is empty here.
        """
        return PlannedNumbers(
            context=self._history.context(look)[None],
            kept_looks=self._history.kept(self._seen.video_looks, look)[None],
            to_keep=np.full((1, RECENT), NO_LOOK),
        )

    def _words(self, chosen: NetworkChoice) -> str:
        """Return a chosen subgoal in words, with the pixel at which its thing was last seen."""
        point = None if chosen.thing is None else self._seen.point(chosen.thing)
        return self._body.forms[chosen.kind].at(point)


class LearnedHands(LearnedPolicy):
    """Moves towards subgoals: those of any planner, or else those of its own planner.

    Attributes:
        subgoal: the one it follows.
    """

    subgoal: str | None = None
    _request: NDArray[np.float32] | None = None
    _namer: SubgoalNamer | None = None

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        super().reset(instruction, demonstration)
        self.subgoal = None
        self._request = None
        self._namer = SubgoalNamer(self.model, self.seen)

    def follow(self, subgoal: str) -> None:
        """Follow a subgoal of another planner from now on; unknown words change nothing."""
        self._namer = None
        self._take(subgoal)

    def act(self, observation: Observation) -> NDArray[np.float64]:
        """Return the next waypoint towards the subgoal, as an array of one row (1, 7).

        As long as no other planner has set a subgoal, its own planner names one. Without any
        subgoal the tool stays where it is.
        """
        seen = self.watch(observation)
        if self._namer is not None:
            self._take(self._namer.next(self.understand()))
        if self._request is None:
            return np.append(observation["end_effector"], GRIPPER_UNCHANGED)[None]
        # Hands are trained without goal: the subgoal is all that they are given.
        no_goal = np.zeros(self.model.body.goals.size, np.float32)
        chosen = seen.decide(no_goal, tool_of(observation), requests_for_hands([self._request]))
        return chosen[None]

    def _take(self, subgoal: str) -> None:
        """Set the subgoal if its words have a known form; else keep the one before."""
        found = encode_request(subgoal, self.model.body.sight)
        if found is not None:
            self.subgoal = subgoal
            self._request = found


class LearnedPlanner:
    """Names subgoals from words, pictures and what it named before, for hands of any kind.

    Args:
        model: whose planner names them.
    """

    cameras = ("front",)
    demonstration_frames = LOOK_EVERY
    observe_every = LOOK_EVERY

    def __init__(self, model: PolicyModel) -> None:
        self.version = model.version
        self._eyes = LearnedPolicy(model)
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
