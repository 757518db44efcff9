"""What understands words: a reader names the task and the goal from words and the first looks.

A look is a moment at which the front picture is looked at.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from roboirg.extension.episodes import goal_schema
from roboirg_learn.listener.listener_net import ListenerNet
from roboirg_learn.listener.object_relations import ObjectsInView, rank_objects
from roboirg_learn.listener.reader_plan import WORDLESS
from roboirg_learn.listener.vocabulary import ListenerInput, Vocabulary
from roboirg_learn.policy.task_net import TaskNet
from roboirg_learn.policy.tracks import Detections
from roboirg_learn.trained_file import TrainedFile, load_trained, save_trained


class HeardGoal(NamedTuple):
    """A goal that was heard: its task, and its values as canonical JSON: ``{"color": "red"}``."""

    task: str
    answer: str


@dataclass(frozen=True)
class TrainedReader:
    """A trained reader.

    Attributes:
        vocabulary: of words, classes of objects, tasks and parts of goals.
        corners: (4, 2) of the area where objects stand, m.
        task_net: names the task.
        net: scores the goals of a task.
        plan: how it was trained, for records; as `ReaderPlan.about` returns it, and more.
        version: fingerprint of its file; empty if it comes from none.
    """

    vocabulary: Vocabulary
    corners: NDArray[np.float64]
    task_net: TaskNet
    net: ListenerNet
    plan: dict[str, Any]
    version: str = ""

    @property
    def nets(self) -> nn.ModuleDict:
        """Its networks by the names that they have in its file."""
        return nn.ModuleDict({"task_net": self.task_net, "reader": self.net})

    def hear(self, text: str, looks: Sequence[Detections]) -> HeardGoal:
        """Return the goal that an instruction means.

        First the task is named, then the goal of that task with the best score.

        Args:
            text: everything that was said; ignored by a reader that was trained without words.
            looks: objects found at the first look, and at a later one of the video if there is one.
        """
        heard = "" if self.plan["words"] == WORDLESS else text
        seen = seen_things(looks, self.corners, self.vocabulary.classes)
        with torch.no_grad():
            (task_scores,) = self.task_net([heard], [seen])
            task = self.vocabulary.tasks[int(task_scores.argmax())]
            (goal_scores,) = self.net([ListenerInput(task, heard, seen)])
        answers = list(goal_schema(task).goals)
        return HeardGoal(task, answers[int(goal_scores.argmax())])


def seen_things(
    looks: Sequence[Detections], corners: NDArray[np.float64], class_names: Sequence[str]
) -> ObjectsInView:
    """Return the objects of one or two looks with their ranks, as the reader of words needs them.

    A rank is such as *second closest to the button*; see `object_relations`.

    Args:
        looks: what the detector found.
        corners: (4, 2) x and y of the corners of the area where objects stand, m.
        class_names: in the order of their numbers.
    """
    positions = np.concatenate([look.positions for look in looks]).astype(np.float64)
    return rank_objects([look.classes for look in looks], positions, corners, class_names)


def save_reader(reader: TrainedReader, path: Path) -> None:
    """Write a trained reader.

    Raises:
        InvalidValueError: the file cannot be written.
    """
    about = {"plan": reader.plan, "vocabulary": reader.vocabulary._asdict()}
    corners = torch.from_numpy(reader.corners)
    save_trained("reader", about, reader.nets, {"corners": corners}, path)


def load_reader(path: Path) -> TrainedReader:
    """Return a trained reader; nothing of the file is executed.

    Raises:
        InvalidValueError: the file is none.
    """
    return load_trained(path, "reader", _read)


def _read(file: TrainedFile) -> TrainedReader:
    """Return the reader of a file: networks made by its description, then given its weights.

    `save_reader` writes what is read here.
    """
    plan = file.about["plan"]
    vocabulary = Vocabulary.of(file.about["vocabulary"])
    reader = TrainedReader(
        vocabulary=vocabulary,
        corners=file.tensors["corners"].numpy(),
        task_net=TaskNet(vocabulary),
        net=ListenerNet(vocabulary, plan["encoders"]),
        plan=plan,
        version=file.version,
    )
    file.load(reader.nets)
    return reader
