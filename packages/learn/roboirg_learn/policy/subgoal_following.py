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
    PLANNER_HISTORIES,
    RECENT,
    SubgoalInputs,
    recent_looks,
    requests_for_hands,
)
from roboirg_learn.policy.subgoals import encode_request

if TYPE_CHECKING:
    from roboirg_learn.policy.policy_model import NetworkChoice, PolicyModel, SeenEpisode


class SubgoalNamer:
    """Names the next subgoal of one episode by a learned planner; call `next` once after each look.

    Args:
        model: whose planner names it.
        seen: the episode as it is seen; whoever acts adds the looks to it.
    """

    def __init__(self, model: PolicyModel, seen: SeenEpisode) -> None:
        self._body = model.body
        self._seen = seen
        planner = self._body.plan["memory"]
        self._history = PLANNER_HISTORIES[planner](len(self._body.templates))
        self._last_choice: tuple[int, int | None] | None = None  # number and track
        self._subgoal = ""

    def next(self, goal: NDArray[np.float32]) -> str:
        """Return the subgoal after the last look, in words with a point, and remember it.

        For example "pick up the red cube at <110, 84>", with row and column in the front picture.
        While the planner chooses the same template and object, the words stay the same, too: the
        point is where the object was when it was chosen first.

        What is named and kept now is input of the planner at the next look, so a second call at
        the same look would count it twice.

        Args:
            goal: (size,) as `GoalLayout.encode` returns it.

        Raises:
            RuntimeError: the policy has no planner.
        """
        if self._body.planner is None:
            raise RuntimeError("This policy has no planner.")
        look = self._seen.looks - 1
        chosen = self._seen.choose(self._body.planner, goal, self._subgoal_inputs(look))
        self._remember(chosen, look)
        choice = (chosen.number, chosen.track)
        if choice != self._last_choice:
            self._last_choice = choice
            self._subgoal = self._words(chosen)
        return self._subgoal

    def _remember(self, chosen: NetworkChoice, look: int) -> None:
        """Add to the history what was named at a look, and which recent looks are to be kept."""
        self._history.name(chosen.number, look)
        recent = recent_looks(look)
        to_keep = [recent[index] for index in chosen.to_keep]
        # Numbers below 0 stand for looks before the first one.
        self._history.choose(number for number in to_keep if number >= 0)

    def _subgoal_inputs(self, look: int) -> SubgoalInputs:
        """Return the planner's input at one look, of its history.

        `to_keep` is a label of training, so nothing stands in it here.
        """
        return SubgoalInputs(
            context=self._history.context(look)[None],
            kept_looks=self._history.kept(self._seen.video_looks, look)[None],
            to_keep=np.full((1, RECENT), NO_LOOK),
        )

    def _words(self, chosen: NetworkChoice) -> str:
        """Return a chosen subgoal in words, with the pixel at which its object was last seen."""
        point = None if chosen.track is None else self._seen.point(chosen.track)
        return self._body.templates[chosen.number].at(point)


class LearnedHands(LearnedPolicy):
    """Moves towards subgoals: those of any planner, or else those of its own planner.

    Until `follow` is called in an episode its own planner names the subgoals.

    Attributes:
        subgoal: the one that it follows, in words; None before the first.
    """

    subgoal: str | None = None
    _request: NDArray[np.float32] | None = None
    _namer: SubgoalNamer | None = None

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode as `LearnedPolicy.reset` does, without a subgoal."""
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
        inputs = requests_for_hands([self._request])
        waypoint = seen.decide(no_goal, tool_of(observation), inputs)
        return waypoint[None]

    def _take(self, subgoal: str) -> None:
        """Set the subgoal if its words are understood; else keep the one before."""
        request = encode_request(subgoal, self.model.body.object_classes)
        if request is not None:
            self.subgoal = subgoal
            self._request = request


class LearnedPlanner:
    """Names subgoals from words, pictures and its history, for hands of any kind.

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
        """How its body and its reader were trained."""
        return self._eyes.metadata

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode: hear the instruction and look at the video."""
        self._eyes.reset(instruction, demonstration)
        self._namer = SubgoalNamer(self._eyes.model, self._eyes.seen)

    def hear(self, text: str, step: int) -> None:
        """Hear another utterance; the goal is understood anew."""
        self._eyes.hear(text, step)

    def plan(self, observation: Observation, step: int) -> str | None:  # noqa: ARG002
        """Return the subgoal from now on, in words with a point."""
        self._eyes.watch(observation)
        return self._namer.next(self._eyes.understand())
