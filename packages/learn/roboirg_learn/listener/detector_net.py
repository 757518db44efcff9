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
"""Most objects that are found in a picture."""
MIN_SCORE = 0.3
"""Probability of a class above which a cell counts as having an object of it."""
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
        """Return class logits (n, classes + 1, GRID, GRID) and offsets (n, 2, GRID, GRID).

        Class 0 is background; offsets are column and row of the center in its cell, in cells.

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
        scores, classes = logits.softmax(dim=1)[:, 1:].max(dim=1)  # without background
        peaks = functional.max_pool2d(scores[:, None], 3, stride=1, padding=1)[:, 0]
        is_object = (scores >= peaks) & (scores > MIN_SCORE)
        of_each_picture = zip(is_object, scores, classes, offsets, strict=True)
        return [_objects_at(*grids) for grids in of_each_picture]


def _objects_at(is_object: Tensor, scores: Tensor, classes: Tensor, offsets: Tensor) -> SeenObjects:
    """Return the objects of one picture, the surest first, at most `MAX_OBJECTS`.

    Args:
        is_object: (GRID, GRID) whether a cell has one.
        scores: (GRID, GRID) of the best class.
        classes: (GRID, GRID) class numbers, from 0.
        offsets: (2, GRID, GRID) column and row of the center in the cell, in cells.
    """
    rows, columns = torch.nonzero(is_object, as_tuple=True)
    surest = scores[rows, columns].argsort(descending=True)[:MAX_OBJECTS]
    rows = rows[surest]
    columns = columns[surest]
    column_offsets, row_offsets = offsets[:, rows, columns]
    centers = torch.stack([columns + column_offsets, rows + row_offsets], dim=1) / GRID
    return SeenObjects(classes[rows, columns].numpy(), centers.numpy().astype(np.float32))


def block(
    inputs: int, outputs: int, size: int = 3, stride: int = 1, dilation: int = 1
) -> tuple[nn.Module, ...]:
    """Return a convolution, batch normalization and ReLU, for ``nn.Sequential(*block(…))``.

    Rows and columns are divided by the stride; at stride 1 they stay as they are.

    Args:
        inputs: channels.
        outputs: channels.
        size: odd, rows and columns of the kernel.
        stride: of the convolution.
        dilation: of the convolution.
    """
    padding = dilation * (size // 2)
    convolution = nn.Conv2d(
        inputs, outputs, size, stride=stride, padding=padding, dilation=dilation, bias=False
    )
    return convolution, nn.BatchNorm2d(outputs), nn.ReLU()


def detector_loss(
    net: DetectorNet, views: Sequence[LabeledView], class_names: Sequence[str]
) -> Tensor:
    """Return the loss of a batch of labeled pictures.

    It adds that of the class of every cell, where background weighs little, and the mean distance
    of the offset in cells with an object.

    Args:
        net: that learns.
        views: uint8 pictures (256, 256, 3) with labels.
        class_names: in the order of their numbers.
    """
    labels = _cell_labels(views, class_names)
    logits, offsets = net(torch.from_numpy(np.stack([view.picture for view in views])))
    weights = torch.ones(len(class_names) + 1)
    weights[0] = BACKGROUND_WEIGHT
    class_loss = functional.cross_entropy(logits, labels.classes, weights)

    has_object = (labels.classes > 0)[:, None]
    distances = functional.l1_loss(offsets, labels.offsets, reduction="none")
    offset_loss = (distances * has_object).sum()
    return class_loss + offset_loss / has_object.sum().clamp(min=1)


class CellLabels(NamedTuple):
    """What is in the cells of n pictures: what the network should return for them.

    Attributes:
        classes: (n, GRID, GRID) class numbers from 1; 0 for background.
        offsets: (n, 2, GRID, GRID) of the center in its cell, column and row, in cells.
    """

    classes: Tensor
    offsets: Tensor


def _cell_labels(views: Sequence[LabeledView], class_names: Sequence[str]) -> CellLabels:
    """Return what the network should say of each cell of some pictures.

    A cell belongs to the object whose center it has; of two objects the later one counts. A center
    at (20, 9) pixels is in row 1 and column 2 of cells of 8 pixels, with the offset (0.5, 0.125).

    Args:
        views: with names and centers, column and row in pixels, of their objects.
        class_names: in the order of their numbers; 0 is background, so classes begin at 1.
    """
    numbers = {name: number for number, name in enumerate(class_names, start=1)}
    classes = torch.zeros(len(views), GRID, GRID, dtype=torch.long)
    offsets = torch.zeros(len(views), 2, GRID, GRID)
    for picture, view in enumerate(views):
        for name, (x, y) in zip(view.names, view.centers / CELL, strict=True):
            row = int(y)
            column = int(x)
            classes[picture, row, column] = numbers[name]
            offsets[picture, :, row, column] = torch.tensor([x - column, y - row])
    return CellLabels(classes, offsets)
