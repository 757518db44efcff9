"""Items of the grounding dataset without pictures: what is asked of an episode, and two masks."""

import numpy as np

from roboirg.apps.grounding.items.grounding_item import PointTarget, encode_mask
from roboirg.apps.grounding.items.item_builder import make_items, wanted_options
from roboirg.apps.grounding.items.media_store import EpisodeMedia
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import plain_settings
from roboirg.tasks.splits.splits import get_episode

SETTINGS = plain_settings()
POINTS = ((10, 40), (30, 40))
"""Columns and rows of the left upper corners of the masks, each of 8 x 8 pixels."""


def two_masks():
    targets = []
    for column, row in POINTS:
        mask = np.zeros((256, 256), bool)
        mask[row : row + 8, column : column + 8] = True
        counts = encode_mask(mask)
        targets.append(PointTarget(kind="cube", x=column, y=row, size=mask.shape, counts=counts))
    return EpisodeMedia("pictures/0.png", None, (), 0, tuple(targets))


def items_of(task, index, *, forms=("implicit",), every_variant=False, split="test"):
    """Return an episode and its items."""
    episode = get_episode(task, split, index)
    options = wanted_options(
        episode, SETTINGS, forms, InstructionOptions(), every_variant=every_variant
    )
    return episode, make_items(episode, two_masks(), list(options))
