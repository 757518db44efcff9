"""A small network that finds the objects of a picture.

A picture is divided into a grid of cells. The network says which object has its center in a cell,
and how far from the cell's corner, the offset.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from roboirg.extension.sight import LabeledView
from roboirg_learn.listener.object_relations import SeenObjects

CELL = 8
"""Pixels of a cell of the grid in which objects are found."""
INPUT_SIZE = 256
"""Rows and columns of the pictures that trained detectors read, so no other size will do."""
GRID = INPUT_SIZE // CELL
CHANNELS = (16, 32, 64, 64)
MAX_OBJECTS = 20
MIN_SCORE = 0.3
BACKGROUND_WEIGHT = 0.02
"""Of a cell without an object in the loss: there are two hundred times as many."""


class DetectorNet(nn.Module):
    """Classifies the cells of a picture: background, or the class of the object centered there.

    Args:
        classes: number of classes of objects.
    """

    def __init__(self, classes: int) -> None:
        super().__init__()
        first, second, third, fourth = CHANNELS
        self.features = nn.Sequential(
            *block(3, first, size=5, stride=2),
            *block(first, second, stride=2),
            *block(second, third, stride=2),
            *block(third, fourth),
        )
        self.kinds = nn.Conv2d(fourth, classes + 1, 1)
        self.offsets = nn.Conv2d(fourth, 2, 1)

    def forward(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Return logits (n, classes + 1, grid, grid) and offsets in cells (n, 2, grid, grid).

        Args:
            pictures: uint8 (n, 256, 256, 3).
        """
        scaled = pictures.permute(0, 3, 1, 2).float() / 255 - 0.5
        features = self.features(scaled)
        return self.kinds(features), self.offsets(features)

    @torch.no_grad()
    def find(self, pictures: Sequence[NDArray[np.uint8]]) -> list[SeenObjects]:
        """Return the objects found in each picture: uint8 (256, 256, 3).

        An object is where a cell's best class scores at least as much as those of all eight
        neighbors, and more than `MIN_SCORE`.
        """
        logits, offsets = self(torch.from_numpy(np.stack(pictures)))
        scores, kinds = logits.softmax(dim=1)[:, 1:].max(dim=1)  # without background
        peaks = functional.max_pool2d(scores[:, None], 3, stride=1, padding=1)[:, 0]
        is_object = (scores >= peaks) & (scores > MIN_SCORE)
        return [
            _objects_at(is_object[number], scores[number], kinds[number], offsets[number])
            for number in range(len(pictures))
        ]


def _objects_at(is_object: Tensor, scores: Tensor, kinds: Tensor, offsets: Tensor) -> SeenObjects:
    """Return the objects of one picture, the surest first, at most `MAX_OBJECTS`.

    Args:
        is_object: (GRID, GRID) whether a cell has one.
        scores: (GRID, GRID) of the best class.
        kinds: (GRID, GRID) numbers of classes.
        offsets: (2, GRID, GRID) column and row of the center in the cell, in cells.
    """
    rows, columns = torch.nonzero(is_object, as_tuple=True)
    surest = scores[rows, columns].argsort(descending=True)[:MAX_OBJECTS]
    rows = rows[surest]
    columns = columns[surest]
    shift = offsets[:, rows, columns]
    centers = torch.stack([columns + shift[0], rows + shift[1]], dim=1) / GRID
    return SeenObjects(kinds[rows, columns].numpy(), centers.numpy().astype(np.float32))


def block(
    inputs: int, outputs: int, size: int = 3, stride: int = 1, dilation: int = 1
) -> tuple[nn.Module, ...]:
    """Return the layers of a convolution, batch normalization and ReLU.

    Rows and columns are divided by the stride; at stride 1 they stay as they are.
    """
    padding = dilation * (size // 2)
    convolution = nn.Conv2d(
        inputs, outputs, size, stride=stride, padding=padding, dilation=dilation, bias=False
    )
    return convolution, nn.BatchNorm2d(outputs), nn.ReLU()


def detector_loss(net: DetectorNet, views: Sequence[LabeledView], classes: Sequence[str]) -> Tensor:
    """Return the loss of a batch of labeled pictures.

    It adds that of the class of every cell, where background weighs little, and the mean distance
    of the offset in cells with an object.

    Args:
        net: that learns.
        views: uint8 pictures (256, 256, 3) with labels.
        classes: names in the order of their numbers.
    """
    labels = _cell_labels(views, classes)
    logits, offsets = net(torch.from_numpy(np.stack([view.picture for view in views])))
    weights = torch.ones(len(classes) + 1)
    weights[0] = BACKGROUND_WEIGHT
    kind_loss = functional.cross_entropy(logits, labels.kinds, weights)

    has_object = (labels.kinds > 0)[:, None]
    distances = functional.l1_loss(offsets, labels.offsets, reduction="none")
    offset_loss = (distances * has_object).sum()
    return kind_loss + offset_loss / has_object.sum().clamp(min=1)


class CellLabels(NamedTuple):
    """What is in the cells of n pictures.

    Attributes:
        kinds: (n, GRID, GRID) numbers of classes from 1; 0 for background.
        offsets: (n, 2, GRID, GRID) of the center in its cell, column and row, in cells.
    """

    kinds: Tensor
    offsets: Tensor


def _cell_labels(views: Sequence[LabeledView], classes: Sequence[str]) -> CellLabels:
    """Return what the network should say of each cell of some pictures.

    A cell belongs to the object whose center it has; of two objects the later one counts.

    Args:
        views: with names and centers, column and row in pixels, of their objects.
        classes: names in the order of their numbers; 0 is background, so classes begin at 1.
    """
    numbers = {name: number for number, name in enumerate(classes, start=1)}
    kinds = torch.zeros(len(views), GRID, GRID, dtype=torch.long)
    offsets = torch.zeros(len(views), 2, GRID, GRID)
    for place, view in enumerate(views):
        for name, (x, y) in zip(view.names, view.centers / CELL, strict=True):
            row = int(y)
            column = int(x)
            kinds[place, row, column] = numbers[name]
            offsets[place, :, row, column] = torch.tensor([x - column, y - row])
    return CellLabels(kinds, offsets)
