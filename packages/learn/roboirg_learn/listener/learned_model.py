"""What a listener has learned: a detector and a reader, in one file of plain tensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args

import torch

from roboirg.extension.commands import InvalidValueError
from roboirg.extension.episodes import Goal, goal_schema
from roboirg_learn.labeled_views import Pixels
from roboirg_learn.listener.detector_net import DetectorNet
from roboirg_learn.listener.listener_net import ListenerNet
from roboirg_learn.listener.object_relations import (
    TablePlane,
    nothing_of,
    relate,
)
from roboirg_learn.listener.vocabulary import ListenerInput, Vocabulary
from roboirg_learn.trained_file import load_nets, load_trained, save_trained

FORMAT = "roboirg-listener-3"
Without = Literal["none", "pictures", "video", "words"]
WITHOUTS: tuple[Without, ...] = get_args(Without)
"""What a variant does not get; the words are then empty.

Without the video, nothing is seen of a scene that has one.
"""


class LearnedModel(NamedTuple):
    """A trained listener.

    Attributes:
        vocabulary: what it can name.
        detector: finds objects.
        plane: of the table in the picture.
        reader: scores goals.
        without: what it does not get.
        about: how it was trained, for records.
    """

    vocabulary: Vocabulary
    detector: DetectorNet
    plane: TablePlane
    reader: ListenerNet
    without: Without
    about: dict[str, Any]

    def understand(self, task: str, text: str, pictures: Sequence[Pixels]) -> Goal:
        """Return the best goal of a task for an instruction.

        Args:
            task: name of the task.
            text: everything that was said.
            pictures: those of `pictures_to_see`.
        """
        return self.understand_seen(self.see(pictures)._replace(task=task, text=text))

    def understand_seen(self, given: ListenerInput) -> Goal:
        """Return the best goal for an instruction, of a scene that has been seen.

        Raises:
            InvalidValueError: it was not trained on the task.
        """
        if given.task not in self.vocabulary.tasks:
            raise InvalidValueError(
                f"This listener was not trained on {given.task}, but on "
                f"{', '.join(self.vocabulary.tasks)}."
            )
        with torch.no_grad():
            (scores,) = self.reader([hide(given, self.without)])
        return list(goal_schema(given.task).goals.values())[int(scores.argmax())]

    def see(self, pictures: Sequence[Pixels]) -> ListenerInput:
        """Return what is seen in pictures, without task and words."""
        seen = relate(self.detector.find(pictures), self.plane, self.vocabulary.classes)
        return ListenerInput("", "", seen, tuple(pictures))


def hide(given: ListenerInput, without: Without) -> ListenerInput:
    """Return an input without pictures, video or words."""
    if without == "pictures" or (without == "video" and given.seen.looks > 1):
        return given._replace(seen=nothing_of(given.seen), pictures=())
    return given._replace(text="") if without == "words" else given


def save_model(model: LearnedModel, path: Path) -> None:
    """Write a trained listener.

    Raises:
        InvalidValueError: the file cannot be written.
    """
    content = {
        "format": FORMAT,
        "vocabulary": model.vocabulary.content,
        "detector": model.detector.state_dict(),
        "plane": {name: torch.from_numpy(one) for name, one in model.plane._asdict().items()},
        "encoders": model.reader.settings,
        "reader": model.reader.state_dict(),
        "without": model.without,
        "about": model.about,
    }
    save_trained(content, path)


def load_model(path: Path) -> LearnedModel:
    """Return a trained listener; nothing of the file is executed.

    Raises:
        InvalidValueError: the file is none.
    """
    return load_trained(path, "listener", FORMAT, _read)


def _read(content: Mapping[str, Any]) -> LearnedModel:
    vocabulary = Vocabulary.of(content["vocabulary"])
    plane = TablePlane(**{name: one.numpy() for name, one in content["plane"].items()})
    detector = DetectorNet(len(vocabulary.classes))
    reader = ListenerNet(vocabulary, content["encoders"])
    load_nets({"detector": detector, "reader": reader}, content)
    return LearnedModel(vocabulary, detector, plane, reader, content["without"], content["about"])
