"""What a listener has learned: a detector and a reader, in one file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import torch
from torch import nn

from roboirg.extension.commands import InvalidValueError
from roboirg.extension.episodes import Goal, goal_schema
from roboirg_learn.labeled_views import Pixels
from roboirg_learn.listener.detector_net import DetectorNet
from roboirg_learn.listener.listener_net import ListenerNet
from roboirg_learn.listener.object_relations import (
    TablePlane,
    locate_and_rank,
    without_objects,
)
from roboirg_learn.listener.vocabulary import ListenerInput, Vocabulary
from roboirg_learn.trained_file import TrainedFile, load_trained, save_trained

Without = Literal["none", "pictures", "video", "words"]
WITHOUTS: tuple[Without, ...] = get_args(Without)
"""What a variant does not get; the words are then empty.

Without the video, nothing is seen of a scene that has one.
"""


@dataclass(frozen=True)
class LearnedModel:
    """A trained listener.

    Attributes:
        vocabulary: what it can name.
        detector: finds objects in pictures.
        plane: maps points of pictures to the table.
        reader: scores goals.
        without: what it does not get: pictures, video or words; "none" for all.
        about: how it was trained, for records; as `TrainingPlan.about` returns it.
        version: fingerprint of its file; empty if it comes from none.
    """

    vocabulary: Vocabulary
    detector: DetectorNet
    plane: TablePlane
    reader: ListenerNet
    without: Without
    about: dict[str, Any]
    version: str = ""

    @property
    def nets(self) -> nn.ModuleDict:
        """Its networks by the names that they have in its file."""
        return nn.ModuleDict({"detector": self.detector, "reader": self.reader})

    def understand(self, task: str, text: str, pictures: Sequence[Pixels]) -> Goal:
        """Return the goal of a task that the listener takes an instruction to mean.

        Args:
            task: name of the task.
            text: everything that was said.
            pictures: those of `pictures_to_see`.
        """
        return self.understand_seen(self.see(pictures)._replace(task=task, text=text))

    def understand_seen(self, given: ListenerInput) -> Goal:
        """Return the goal that an instruction means, given what `see` returned of its scene.

        Raises:
            InvalidValueError: it was not trained on the task.
        """
        if given.task not in self.vocabulary.tasks:
            raise InvalidValueError(
                f"This listener was not trained on {given.task}, but on "
                f"{', '.join(self.vocabulary.tasks)}."
            )
        goals = list(goal_schema(given.task).goals.values())
        with torch.no_grad():
            (scores,) = self.reader([hide_inputs(given, self.without)])
        return goals[int(scores.argmax())]

    def see(self, pictures: Sequence[Pixels]) -> ListenerInput:
        """Return the objects found in one or two pictures; task and words are still empty."""
        seen = locate_and_rank(self.detector.find(pictures), self.plane, self.vocabulary.classes)
        return ListenerInput("", "", seen, tuple(pictures))


def hide_inputs(given: ListenerInput, without: Without) -> ListenerInput:
    """Return an input without what a listener does not get.

    Without the video nothing is seen of a scene that has one, which is seen in two pictures; other
    scenes are seen as they are.

    Args:
        given: what there is.
        without: pictures, video or words; "none" hides nothing.
    """
    has_video = given.seen.looks > 1
    if without == "pictures" or (without == "video" and has_video):
        return given._replace(seen=without_objects(given.seen), pictures=())
    if without == "words":
        return given._replace(text="")
    return given


def save_model(model: LearnedModel, path: Path) -> None:
    """Write a trained listener.

    Raises:
        InvalidValueError: the file cannot be written.
    """
    about = {"plan": model.about, "vocabulary": model.vocabulary._asdict()}
    plane = {
        "matrix": torch.from_numpy(model.plane.matrix),
        "corners": torch.from_numpy(model.plane.corners),
    }
    save_trained("listener", about, model.nets, plane, path)


def load_model(path: Path) -> LearnedModel:
    """Return a trained listener; nothing of the file is executed.

    Raises:
        InvalidValueError: the file is none.
    """
    return load_trained(path, "listener", _read)


def _read(file: TrainedFile) -> LearnedModel:
    """Return the listener of a file: networks made by its plan, then given its weights.

    `save_model` writes what is read here.
    """
    plan = file.about["plan"]
    vocabulary = Vocabulary.of(file.about["vocabulary"])
    plane = TablePlane(file.tensors["matrix"].numpy(), file.tensors["corners"].numpy())
    model = LearnedModel(
        vocabulary=vocabulary,
        detector=DetectorNet(len(vocabulary.classes)),
        plane=plane,
        reader=ListenerNet(vocabulary, plan["encoders"]),
        without=plan["without"],
        about=plan,
        version=file.version,
    )
    file.load(model.nets)
    return model
