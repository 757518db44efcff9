"""A small network that finds the objects of a picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from roboirg.extension.sight import LabeledView
from roboirg_learn.listener.object_relations import SeenObjects

CELL = 8
"""Pixels of a cell of the grid in which objects are found."""
SIZE = 256
GRID = SIZE // CELL
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
        """Return the objects of each picture: cells that are surer than all their neighbors."""
        logits, offsets = self(torch.from_numpy(np.stack(pictures)))
        scores, kinds = logits.softmax(dim=1)[:, 1:].max(dim=1)
        peaks = functional.max_pool2d(scores[:, None], 3, stride=1, padding=1)[:, 0]
        sure = (scores >= peaks) & (scores > MIN_SCORE)
        found = []
        for place in range(len(pictures)):
            rows, columns = torch.nonzero(sure[place], as_tuple=True)
            best = scores[place, rows, columns].argsort(descending=True)[:MAX_OBJECTS]
            rows, columns = rows[best], columns[best]
            shift = offsets[place, :, rows, columns]
            centers = torch.stack([columns + shift[0], rows + shift[1]], dim=1) / GRID
            found.append(
                SeenObjects(kinds[place, rows, columns].numpy(), centers.numpy().astype(np.float32))
            )
        return found


def block(
    inputs: int, outputs: int, size: int = 3, stride: int = 1, dilation: int = 1
) -> tuple[nn.Module, ...]:
    """Return a convolution that keeps the size up to its stride, normalized and rectified."""
    padding = dilation * (size // 2)
    convolution = nn.Conv2d(
        inputs, outputs, size, stride=stride, padding=padding, dilation=dilation, bias=False
    )
    return convolution, nn.BatchNorm2d(outputs), nn.ReLU()


def detector_loss(net: DetectorNet, views: Sequence[LabeledView], classes: Sequence[str]) -> Tensor:
    """Return the loss of a batch: the class of each cell, and where in its cell a center is."""
    numbers = {name: number for number, name in enumerate(classes, start=1)}
    kinds = torch.zeros(len(views), GRID, GRID, dtype=torch.long)
    shifts = torch.zeros(len(views), 2, GRID, GRID)
    for place, view in enumerate(views):
        for name, (column, row) in zip(view.names, view.centers / CELL, strict=True):
            cell = int(row), int(column)
            kinds[place, *cell] = numbers[name]
            shifts[place, :, *cell] = torch.tensor([column - cell[1], row - cell[0]])
    logits, offsets = net(torch.from_numpy(np.stack([view.picture for view in views])))
    weights = torch.ones(len(classes) + 1)
    weights[0] = BACKGROUND_WEIGHT
    there = (kinds > 0)[:, None]
    misplaced = (functional.l1_loss(offsets, shifts, reduction="none") * there).sum()
    return functional.cross_entropy(logits, kinds, weights) + misplaced / there.sum().clamp(min=1)
