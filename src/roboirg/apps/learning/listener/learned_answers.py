"""Answers of a trained listener to the grounding dataset."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import av
import cv2
import numpy as np

from roboirg.apps.learning.labeled_views import LATER_STEP, pictures_to_see
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.grounding_items.answer_file import Answer
from roboirg.evaluation.grounding_items.grounding_item import GroundingItem
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.util.media import CONTROL_RATE, Pixels

if TYPE_CHECKING:
    from roboirg.apps.learning.listener.learned_model import LearnedModel


def learned_answers(
    model: LearnedModel, items: Sequence[GroundingItem], folder: Path
) -> Iterator[Answer]:
    """Yield the slots that a trained listener understands, from words and stored pictures.

    Args:
        model: the listener.
        items: of the dataset.
        folder: of the dataset.
    """
    for item in items:
        frames, every = ([], 1) if item.video is None else _begin(folder / item.video)
        pictures = pictures_to_see(_read(folder / item.picture), frames, every)
        goal = model.understand(item.task, item.text, pictures)
        yield Answer(item.id, "slots", goal_schema(item.task).answers[goal])


def _begin(path: Path) -> tuple[list[Pixels], int]:
    """Return the frames of a video up to the one that is looked at, and the steps between two."""
    try:
        with av.open(str(path)) as container:
            stream = container.streams.video[0]
            every = round(CONTROL_RATE / (stream.average_rate or CONTROL_RATE))
            shown = itertools.islice(container.decode(stream), LATER_STEP // every + 1)
            return [np.asarray(one.to_ndarray(format="rgb24"), np.uint8) for one in shown], every
    except (OSError, IndexError) as error:
        raise InvalidValueError(
            f"The video {path} of the dataset is missing or damaged ({error})."
        ) from error


def _read(path: Path) -> Pixels:
    found = cv2.imread(str(path))
    if found is None:
        raise InvalidValueError(f"The picture {path} of the dataset is missing or damaged.")
    return np.asarray(cv2.cvtColor(found, cv2.COLOR_BGR2RGB), dtype=np.uint8)
