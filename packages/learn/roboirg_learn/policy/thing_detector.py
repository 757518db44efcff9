"""A small network that finds the things of a front picture: class, place and angle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from roboirg_learn.listener.detector_net import block
from roboirg_learn.policy.sight import COLUMNS, ROWS

CELL = 4
"""Pixels of a cell of the grid in which things are found."""
GRID = ((ROWS[1] - ROWS[0]) // CELL, COLUMNS // CELL)
CHANNELS = (16, 24, 40, 40)
MOST_THINGS = 24
LEAST_SCORE = 0.6
MOST_SHIFT = 20
"""Pixels by which a picture is moved while a detector learns."""
RARE = -4.0
"""Logit of a class in a cell before anything is learned."""
PRESENT_WEIGHT = 30.0
"""Of a cell with a thing in the loss: most have none."""


class LabeledPicture(NamedTuple):
    """A picture with what is in it.

    Attributes:
        picture: uint8 (256, 256, 3).
        classes: (n,) numbers of classes.
        points: (n, 2) column and row of the origins, pixels.
        turns: (n, 2) cosine and sine of four times the angles.
    """

    picture: NDArray[np.uint8]
    classes: NDArray[np.int64]
    points: NDArray[np.float64]
    turns: NDArray[np.float32]


class ThingDetector(nn.Module):
    """Scores each class in each cell of a grid, and refines the place and the angle there.

    Args:
        classes: number of classes.
    """

    def __init__(self, classes: int) -> None:
        super().__init__()
        first, second, third, fourth = CHANNELS
        self.features = nn.Sequential(
            *block(3, first, size=5, stride=2),
            *block(first, second, stride=2),
            *block(second, third),
            *block(third, fourth, dilation=2),
        )
        self.scores = nn.Conv2d(fourth, classes, 1)
        self.details = nn.Conv2d(fourth, 4, 1)
        bias: Any = self.scores.bias
        nn.init.constant_(bias, RARE)

    def forward(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Return logits (n, classes, *GRID), and offsets in cells and angles (n, 4, *GRID).

        Args:
            pictures: uint8 (n, 256, 256, 3).
        """
        part = pictures[:, ROWS[0] : ROWS[1]].permute(0, 3, 1, 2).float() / 255 - 0.5
        features = self.features(part)
        return self.scores(features), self.details(features)

    @torch.no_grad()
    def find(self, pictures: Sequence[NDArray[np.uint8]]) -> list[LabeledPicture]:
        """Return the things of each picture: cells that are surer than all near them."""
        logits, details = self(torch.from_numpy(np.stack(pictures)))
        scores = logits.sigmoid()
        peaks = functional.max_pool2d(scores, 3, stride=1, padding=1)
        sure = (scores >= peaks) & (scores > LEAST_SCORE)
        found = []
        for picture, own, score, detail in zip(pictures, sure, scores, details, strict=True):
            kinds, rows, columns = torch.nonzero(own, as_tuple=True)
            best = score[kinds, rows, columns].argsort(descending=True)[:MOST_THINGS]
            kinds, rows, columns = kinds[best], rows[best], columns[best]
            shift = detail[:, rows, columns].numpy().T
            points = (np.stack([columns, rows], 1) + shift[:, :2]) * CELL + (0, ROWS[0])
            turns = shift[:, 2:].astype(np.float32)
            found.append(LabeledPicture(picture, kinds.numpy(), points, turns))
        return found


def varied(view: LabeledPicture, rng: np.random.Generator) -> LabeledPicture:
    """Return a picture moved by some pixels, and mirrored half the time, with its labels.

    A few scenes show each thing in a few places only, and a detector learns those by heart.
    """
    down, right = rng.integers(-MOST_SHIFT, MOST_SHIFT + 1, 2).tolist()
    rows, columns = view.picture.shape[:2]
    picture = view.picture[np.clip(np.arange(rows) - down, 0, rows - 1)]
    picture = picture[:, np.clip(np.arange(columns) - right, 0, columns - 1)]
    points, turns = view.points + np.array([right, down]), view.turns
    if rng.random() < 0.5:  # noqa: PLR2004
        picture, turns = picture[:, ::-1], turns * np.array([1.0, -1.0], np.float32)
        points = np.array([columns, 0.0]) + points * np.array([-1.0, 1.0])
    return LabeledPicture(picture, view.classes, points, turns)


def detector_loss(net: ThingDetector, views: Sequence[LabeledPicture]) -> Tensor:
    """Return the loss of a batch: where each class is, and place and angle there."""
    logits, details = net(torch.from_numpy(np.stack([view.picture for view in views])))
    there = torch.zeros_like(logits)
    wanted = torch.zeros_like(details)
    for number, view in enumerate(views):
        cells = (view.points - (0, ROWS[0])) / CELL
        for kind, (column, row), turn in zip(view.classes, cells, view.turns, strict=True):
            if 0 <= row < GRID[0] and 0 <= column < GRID[1]:
                spot = int(row), int(column)
                there[number, int(kind), *spot] = 1.0
                wanted[number, :, *spot] = torch.tensor([column - spot[1], row - spot[0], *turn])
    weights = torch.where(there > 0, PRESENT_WEIGHT, 1.0)
    scored = functional.binary_cross_entropy_with_logits(logits, there, weights, reduction="sum")
    has = there.amax(1, keepdim=True)
    refined = (functional.l1_loss(details, wanted, reduction="none") * has).sum()
    return (scored / PRESENT_WEIGHT + refined) / there.sum().clamp(min=1.0)
