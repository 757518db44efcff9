"""A small network that finds the things of a front picture: class, place and angle.

The part of the picture that shows the table is divided into a grid of cells. Pictures that a
detector learns from are moved and mirrored.
"""

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
TABLE_CORNER = (0, ROWS[0])
"""Column and row, pixels, of the corner of the part of a picture in which things are found."""
MIRRORED = 0.5
"""Share of the pictures that are mirrored while a detector learns."""
CHANNELS = (16, 24, 40, 40)
MOST_THINGS = 24
LEAST_SCORE = 0.6
MOST_SHIFT = 20
"""Pixels by which a picture is moved while a detector learns."""
INITIAL_LOGIT = -4.0
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
        # In each cell a score of each class; and column, row, cosine and sine of a thing.
        self.scores = nn.Conv2d(fourth, classes, 1)
        self.details = nn.Conv2d(fourth, 4, 1)
        bias: Any = self.scores.bias
        nn.init.constant_(bias, INITIAL_LOGIT)

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
        """Return the things found in each picture: uint8 (256, 256, 3).

        A thing is where a class's score in a cell is at least that of all eight neighbors, and
        more than `LEAST_SCORE`.
        """
        logits, details = self(torch.from_numpy(np.stack(pictures)))
        scores = logits.sigmoid()
        peaks = functional.max_pool2d(scores, 3, stride=1, padding=1)
        is_thing = (scores >= peaks) & (scores > LEAST_SCORE)
        found = []
        for number, picture in enumerate(pictures):
            cells = _surest_cells(is_thing[number], scores[number])
            found.append(_labels_at(cells, details[number], picture))
        return found


class _Cells(NamedTuple):
    """Cells of a grid (n,), each with the class that is there."""

    kinds: Tensor
    rows: Tensor
    columns: Tensor


def _surest_cells(is_thing: Tensor, scores: Tensor) -> _Cells:
    """Return the cells that have a thing, the surest first, at most `MOST_THINGS`.

    Args:
        is_thing: (classes, *GRID) whether a thing of the class is in the cell.
        scores: of the same shape.
    """
    kinds, rows, columns = torch.nonzero(is_thing, as_tuple=True)
    surest = scores[kinds, rows, columns].argsort(descending=True)[:MOST_THINGS]
    return _Cells(kinds[surest], rows[surest], columns[surest])


def _labels_at(cells: _Cells, details: Tensor, picture: NDArray[np.uint8]) -> LabeledPicture:
    """Return the things in some cells of a picture.

    Args:
        cells: n of them, with classes.
        details: (4, *GRID) column and row in the cell, in cells, and two numbers of the angle.
        picture: that the cells are of.
    """
    cell_details = details[:, cells.rows, cells.columns].numpy().T  # (n, 4)
    corners = np.stack([cells.columns, cells.rows], 1)
    points = (corners + cell_details[:, :2]) * CELL + TABLE_CORNER
    turns = cell_details[:, 2:].astype(np.float32)
    return LabeledPicture(picture, cells.kinds.numpy(), points, turns)


def augmented(view: LabeledPicture, rng: np.random.Generator) -> LabeledPicture:
    """Return a picture moved at random by some pixels, and mirrored half the time, with its labels.

    A few scenes show each thing in a few places only, and a detector learns those by heart.
    """
    down, right = rng.integers(-MOST_SHIFT, MOST_SHIFT + 1, 2).tolist()
    moved = _moved(view, down, right)
    is_mirrored = rng.random() < MIRRORED
    return _mirrored(moved) if is_mirrored else moved


def _moved(view: LabeledPicture, down: int, right: int) -> LabeledPicture:
    """Return a picture moved down and right, in pixels; repeated border pixels fill the gap."""
    height, width = view.picture.shape[:2]
    rows = np.clip(np.arange(height) - down, 0, height - 1)
    columns = np.clip(np.arange(width) - right, 0, width - 1)
    points = view.points + np.array([right, down])
    return view._replace(picture=view.picture[rows][:, columns], points=points)


def _mirrored(view: LabeledPicture) -> LabeledPicture:
    """Return a picture with left and right exchanged; the sines of its angles change sign."""
    width = view.picture.shape[1]
    points = np.array([width, 0.0]) + view.points * np.array([-1.0, 1.0])
    turns = view.turns * np.array([1.0, -1.0], np.float32)
    return view._replace(picture=view.picture[:, ::-1], points=points, turns=turns)


def detector_loss(net: ThingDetector, views: Sequence[LabeledPicture]) -> Tensor:
    """Return the loss of a batch: class scores in all cells, place and angle in cells with a thing.

    Cells with a thing are rare, so they weigh `PRESENT_WEIGHT` times as much.
    """
    logits, details = net(torch.from_numpy(np.stack([view.picture for view in views])))
    is_there = torch.zeros_like(logits)
    wanted = torch.zeros_like(details)
    for number, view in enumerate(views):
        _label_cells(view, is_there[number], wanted[number])
    weights = torch.where(is_there > 0, PRESENT_WEIGHT, 1.0)
    score_loss = functional.binary_cross_entropy_with_logits(
        logits, is_there, weights, reduction="sum"
    )

    has_thing = is_there.amax(1, keepdim=True)
    distances = functional.l1_loss(details, wanted, reduction="none")
    detail_loss = (distances * has_thing).sum()
    return (score_loss / PRESENT_WEIGHT + detail_loss) / is_there.sum().clamp(min=1.0)


def _label_cells(view: LabeledPicture, is_there: Tensor, wanted: Tensor) -> None:
    """Write the labels of one picture into its grids, in place.

    Args:
        view: the labeled picture.
        is_there: (classes, *GRID) becomes 1 where a thing of the class is.
        wanted: (4, *GRID) becomes the thing's column and row in its cell, in cells, and its turn.
    """
    cells = (view.points - TABLE_CORNER) / CELL
    for kind, (x, y), turn in zip(view.classes, cells, view.turns, strict=True):
        if 0 <= y < GRID[0] and 0 <= x < GRID[1]:
            row = int(y)
            column = int(x)
            is_there[int(kind), row, column] = 1.0
            wanted[:, row, column] = torch.tensor([x - column, y - row, *turn])
