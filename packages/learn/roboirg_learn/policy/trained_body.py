"""What acts: a body sees, remembers and moves for a goal that it is given, and knows no words.

Its detector finds objects in pictures, its net chooses the next waypoint. A body with a planner has
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
from roboirg_learn.policy.object_detector import ObjectDetector
from roboirg_learn.policy.planner_history import PLANNER_HISTORIES
from roboirg_learn.policy.policy_plan import HANDS, PLANNERS
from roboirg_learn.policy.sight import ObjectClasses
from roboirg_learn.policy.subgoals import REQUEST_SIZE, SubgoalTemplate
from roboirg_learn.policy.tracks import Detections
from roboirg_learn.trained_file import TrainedFile, load_trained, save_trained

Choice = Move | SubgoalTemplate
"""What a network chooses among: types of waypoints, or for planners subgoal templates."""
Pictures = Sequence[NDArray[np.uint8]]


@dataclass(frozen=True)
class GoalLayout:
    """Which number of an encoded goal stands for which task, and for which part of an answer.

    An answer is a goal in JSON; its parts are such as ``color=red`` (`vocabulary.parts_of`).

    Attributes:
        tasks: names of tasks.
        parts: of answers; they come after the tasks.
    """

    tasks: tuple[str, ...]
    parts: tuple[str, ...]

    @property
    def size(self) -> int:
        """How many numbers a goal has."""
        return len(self.tasks) + len(self.parts)

    def encode(self, task: str, answer: str) -> NDArray[np.float32]:
        """Return a goal as network input (size,): 1 for its task and each of its parts, else 0.

        With tasks (A, B) and parts (color=blue, color=red), task B and red → [0, 1, 0, 1].

        Args:
            task: name of the task.
            answer: the goal's values as canonical JSON, such as ``{"color": "red"}``.
        """
        encoded = np.zeros(self.size, np.float32)
        encoded[self.tasks.index(task)] = 1.0
        for part in parts_of(answer):
            encoded[len(self.tasks) + self.parts.index(part)] = 1.0
        return encoded

    def encode_episode(self, episode: Episode) -> NDArray[np.float32]:
        """Return an episode's own goal, encoded: (size,)."""
        answer = goal_schema(episode.task).answers[episode.goal]
        return self.encode(episode.task, answer)


@dataclass(frozen=True)
class TrainedBody:
    """A trained body.

    Attributes:
        object_classes: classes of objects, and the heights at which they stand.
        detector: finds them.
        goals: how goals are encoded.
        moves: types of waypoints, in the order of the network's outputs.
        net: chooses the next move; with a planner it is the hands, which follow subgoals.
        plan: how it was trained, for records; as `BodyPlan.about` returns it.
        templates: of the subgoals that its planner names, in the order of the planner's outputs.
        planner: names the next subgoal; None if it has none, and then its net follows none.
        version: fingerprint of its file; empty if it comes from none.
    """

    object_classes: ObjectClasses
    detector: ObjectDetector
    goals: GoalLayout
    moves: tuple[Move, ...]
    net: BodyNet
    plan: dict[str, Any]
    templates: tuple[SubgoalTemplate, ...] = ()
    planner: BodyNet | None = None
    version: str = ""

    @property
    def nets(self) -> nn.ModuleDict:
        """Its networks by the names that they have in its file."""
        return nn.ModuleDict({"detector": self.detector, "body": self.net, "planner": self.planner})

    def see(self, pictures: Pictures) -> list[Detections]:
        """Return for each front picture the objects found in it, with positions on the table."""
        found = []
        for picture in self.detector.find(pictures):
            positions = self.object_classes.table_positions(picture.classes, picture.points)
            found.append(Detections(picture.classes, positions, picture.yaw_codes))
        return found


def make_body(
    object_classes: ObjectClasses, goals: GoalLayout, choices: Sequence[Choice], memory: str
) -> BodyNet:
    """Return the untrained network of a body or planner.

    Args:
        object_classes: classes of objects.
        goals: how many numbers a goal has.
        choices: what it chooses among: moves, or for a planner subgoal templates.
        memory: a name of `MEMORIES`.
    """
    context = 0  # numbers about subgoals that it is given at each decision
    if memory == HANDS:
        context = REQUEST_SIZE
    elif memory in PLANNERS:
        context = len(PLANNER_HISTORIES[memory](len(choices)).context(0))
    at_objects = [choice.at_object for choice in choices]
    return BodyNet(len(object_classes.names), goals.size, at_objects, memory, context)


def save_body(body: TrainedBody, path: Path) -> None:
    """Write a trained body.

    Raises:
        InvalidValueError: the file cannot be written.
    """
    about = {
        "plan": body.plan,
        "classes": body.object_classes.names,
        "parts": body.goals.parts,
        "moves": body.moves,
        "forms": [template.words for template in body.templates],
    }
    heights = torch.from_numpy(body.object_classes.heights)
    save_trained("body", about, body.nets, {"heights": heights}, path)


def load_body(path: Path) -> TrainedBody:
    """Return a trained body; nothing of the file is executed.

    Raises:
        InvalidValueError: the file is none.
    """
    return load_trained(path, "body", _read)


def _read(file: TrainedFile) -> TrainedBody:
    """Return the body of a file: networks made by its description, then given its weights.

    `save_body` writes what is read here.
    """
    about = file.about
    plan = about["plan"]
    object_classes = ObjectClasses(tuple(about["classes"]), file.tensors["heights"].numpy())
    goals = GoalLayout(tuple(plan["tasks"]), tuple(about["parts"]))
    moves = tuple(Move(*values) for values in about["moves"])
    templates = tuple(SubgoalTemplate(words) for words in about["forms"])
    planner = None
    memory = plan["memory"]
    if memory in PLANNERS:
        planner = make_body(object_classes, goals, templates, memory)
        memory = HANDS
    body = TrainedBody(
        object_classes=object_classes,
        detector=ObjectDetector(len(object_classes.names)),
        goals=goals,
        moves=moves,
        net=make_body(object_classes, goals, moves, memory),
        plan=plan,
        templates=templates,
        planner=planner,
        version=file.version,
    )
    file.load(body.nets)
    return body
