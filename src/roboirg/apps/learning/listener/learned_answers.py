"""Answers of a trained listener to the grounding dataset."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.grounding_items.answer_file import Answer
from roboirg.evaluation.grounding_items.grounding_item import GroundingItem
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.util.media import Pixels

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
    from roboirg.apps.learning.listener.learned_model import pictures_to_see

    for item in items:
        frames = [_read(folder / path) for path in item.frames]
        # The frames are evenly spaced over the video.
        every = max(1, item.video_steps // max(1, len(frames) - 1))
        pictures = pictures_to_see(_read(folder / item.picture), frames, every)
        goal = model.understand(item.task, item.text, pictures)
        yield Answer(item.id, "slots", goal_schema(item.task).answers[goal])


def _read(path: Path) -> Pixels:
    found = cv2.imread(str(path))
    if found is None:
        raise InvalidValueError(f"The picture {path} of the dataset is missing or damaged.")
    return np.asarray(cv2.cvtColor(found, cv2.COLOR_BGR2RGB), dtype=np.uint8)
