"""What acts: a body sees, remembers and moves for a goal that it is given, and knows no words.

Its detector finds things in pictures, its net chooses the next waypoint. A body with a planner has
a second net, which names subgoals; its first net, the hands, follows them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from roboirg.extension.episodes import Episode, goal_schema
from roboirg_learn.listener.vocabulary import parts_of
from roboirg_learn.policy.body_net import BodyNet
from roboirg_learn.policy.moves import Move
from roboirg_learn.policy.planner_history import context_size
from roboirg_learn.policy.policy_plan import HANDS, PLANNERS
from roboirg_learn.policy.sight import Sight
from roboirg_learn.policy.subgoals import REQUEST_SIZE, SubgoalForm
from roboirg_learn.policy.thing_detector import ThingDetector
from roboirg_learn.policy.tracks import LookTokens
from roboirg_learn.trained_file import TrainedFile, load_trained, save_trained

Kind = Move | SubgoalForm
"""What a network chooses among: kinds of waypoints, or forms of subgoals."""
Pictures = Sequence[NDArray[np.uint8]]


@dataclass(frozen=True)
class GoalLayout:
    """Which number of a goal stands for which task, and for which part of an answer.

    Attributes:
        tasks: names of tasks.
        parts: parts of answers, such as ``color=red``; they come after the tasks.
    """

    tasks: tuple[str, ...]
    parts: tuple[str, ...]

    @property
    def size(self) -> int:
        """How many numbers a goal has."""
        return len(self.tasks) + len(self.parts)

    def numbers(self, task: str, answer: str) -> NDArray[np.float32]:
        """Return a goal as network input (size,): 1 for its task and each of its parts, else 0.

        Args:
            task: name of the task.
            answer: the goal's values as canonical JSON, such as ``{"color": "red"}``.
        """
        found = np.zeros(self.size, np.float32)
        found[self.tasks.index(task)] = 1.0
        for part in parts_of(answer):
            found[len(self.tasks) + self.parts.index(part)] = 1.0
        return found

    def of_episode(self, episode: Episode) -> NDArray[np.float32]:
        """Return the numbers of an episode's own goal."""
        answer = goal_schema(episode.task).answers[episode.goal]
        return self.numbers(episode.task, answer)


@dataclass(frozen=True)
class TrainedBody:
    """A trained body.

    Attributes:
        sight: classes of things, and the heights at which they stand.
        detector: finds them.
        goals: what it can be given as goals.
        moves: kinds of waypoints.
        net: chooses the next waypoint.
        plan: how it was trained, for records; as `BodyPlan.about` returns it.
        forms: of the subgoals that its planner names.
        planner: names the next subgoal; None if it has none, and then its net follows none.
        version: fingerprint of its file; empty if it comes from none.
    """

    sight: Sight
    detector: ThingDetector
    goals: GoalLayout
    moves: tuple[Move, ...]
    net: BodyNet
    plan: dict[str, Any]
    forms: tuple[SubgoalForm, ...] = ()
    planner: BodyNet | None = None
    version: str = ""

    @property
    def nets(self) -> nn.ModuleDict:
        """Its networks by the names that they have in its file."""
        return nn.ModuleDict({"detector": self.detector, "body": self.net, "planner": self.planner})

    def see(self, pictures: Pictures) -> list[LookTokens]:
        """Return for each front picture the things found in it, with places on the table, m."""
        found = []
        for things in self.detector.find(pictures):
            places = self.sight.places(things.classes, things.points)
            found.append(LookTokens(things.classes, places, things.turns))
        return found


def make_body(sight: Sight, goals: GoalLayout, moves: Sequence[Kind], memory: str) -> BodyNet:
    """Return an untrained body or planner.

    Args:
        sight: classes of things.
        goals: how many numbers a goal has.
        moves: what it chooses among: kinds of waypoints, or for a planner forms of subgoals.
        memory: a name of `MEMORIES`.
    """
    context = 0  # numbers about subgoals that it is given at each decision
    if memory == HANDS:
        context = REQUEST_SIZE
    elif memory in PLANNERS:
        context = context_size(len(moves))
    at_things = [move.at_thing for move in moves]
    return BodyNet(len(sight.classes), goals.size, at_things, memory, context)


def save_body(body: TrainedBody, path: Path) -> None:
    """Write a trained body.

    Raises:
        InvalidValueError: the file cannot be written.
    """
    about = {
        "plan": body.plan,
        "classes": body.sight.classes,
        "parts": body.goals.parts,
        "moves": body.moves,
        "forms": [form.words for form in body.forms],
    }
    heights = torch.from_numpy(body.sight.heights)
    save_trained("body", about, body.nets, {"heights": heights}, path)


def load_body(path: Path) -> TrainedBody:
    """Return a trained body; nothing of the file is executed.

    Raises:
        InvalidValueError: the file is none.
    """
    return load_trained(path, "body", _read)


def _read(file: TrainedFile) -> TrainedBody:
    """Return the body of a file: networks made by its description, then given its weights."""
    about = file.about
    plan = about["plan"]
    sight = Sight(tuple(about["classes"]), file.tensors["heights"].numpy())
    goals = GoalLayout(tuple(plan["tasks"]), tuple(about["parts"]))
    moves = tuple(Move(*values) for values in about["moves"])
    forms = tuple(SubgoalForm(words) for words in about["forms"])
    has_planner = plan["memory"] in PLANNERS
    body = TrainedBody(
        sight=sight,
        detector=ThingDetector(len(sight.classes)),
        goals=goals,
        moves=moves,
        net=make_body(sight, goals, moves, HANDS if has_planner else plan["memory"]),
        plan=plan,
        forms=forms,
        planner=make_body(sight, goals, forms, plan["memory"]) if has_planner else None,
        version=file.version,
    )
    file.load(body.nets)
    return body
