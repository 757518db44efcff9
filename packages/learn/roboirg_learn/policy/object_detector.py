"""A small network that finds the objects of a front picture: class, point and angle.

The part of the picture that shows the table is divided into a grid of cells. Pictures that a
detector learns from are augmented: shifted and mirrored.
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
"""Pixels of a cell of the grid in which objects are found."""
GRID = ((ROWS[1] - ROWS[0]) // CELL, COLUMNS // CELL)
"""Rows and columns of cells."""
TABLE_CORNER = (0, ROWS[0])
"""Column and row, pixels, of the corner of the part of a picture in which objects are found."""
MIRRORED = 0.5
"""Share of the pictures that are mirrored while a detector learns."""
CHANNELS = (16, 24, 40, 40)
MOST_OBJECTS = 24
"""Most objects that are found in a picture."""
LEAST_SCORE = 0.6
"""Probability of a class above which a cell counts as having an object of it."""
MOST_SHIFT = 20
"""Pixels by which a picture is shifted at most while a detector learns."""
INITIAL_LOGIT = -4.0
"""Logit of a class in a cell before anything is learned."""
PRESENT_WEIGHT = 30.0
"""Of a cell with an object in the loss: most have none."""


class LabeledPicture(NamedTuple):
    """A picture with the n objects in it: labels to learn, or what a detector has found.

    Attributes:
        picture: uint8 (256, 256, 3).
        classes: (n,) class numbers, indices into `ObjectClasses`.
        points: (n, 2) column and row of the origins, pixels.
        yaw_codes: (n, 2) cosine and sine of four times the angles, as of `encode_yaws`.
    """

    picture: NDArray[np.uint8]
    classes: NDArray[np.int64]
    points: NDArray[np.float64]
    yaw_codes: NDArray[np.float32]


class ObjectDetector(nn.Module):
    """Scores each class in each cell of a grid, and refines point and angle there.

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
        # In each cell a score of each class; and column, row, cosine and sine of an object.
        self.scores = nn.Conv2d(fourth, classes, 1)
        self.details = nn.Conv2d(fourth, 4, 1)
        bias: Any = self.scores.bias
        nn.init.constant_(bias, INITIAL_LOGIT)

    def forward(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Return for each cell of n pictures its class logits, and point and angle of its object.

        Logits are (n, classes, *GRID). The details (n, 4, *GRID) are column and row of the object's
        origin from the corner of its cell, in cells, and its yaw code.

        Args:
            pictures: uint8 (n, 256, 256, 3).
        """
        table = pictures[:, ROWS[0] : ROWS[1]].permute(0, 3, 1, 2)
        scaled = table.float() / 255 - 0.5
        features = self.features(scaled)
        return self.scores(features), self.details(features)

    @torch.no_grad()
    def find(self, pictures: Sequence[NDArray[np.uint8]]) -> list[LabeledPicture]:
        """Return the objects found in each picture: uint8 (256, 256, 3).

        An object is where a class's score in a cell is at least that of all eight neighbors, and
        more than `LEAST_SCORE`.
        """
        logits, details = self(torch.from_numpy(np.stack(pictures)))
        scores = logits.sigmoid()
        peaks = functional.max_pool2d(scores, 3, stride=1, padding=1)
        is_object = (scores >= peaks) & (scores > LEAST_SCORE)
        found = []
        for picture, *grids in zip(pictures, is_object, scores, details, strict=True):
            found.append(_objects_in(picture, *grids))
        return found


def _objects_in(
    picture: NDArray[np.uint8], is_object: Tensor, scores: Tensor, details: Tensor
) -> LabeledPicture:
    """Return the objects of one picture, the surest first, at most `MOST_OBJECTS`.

    `_label_cells` does the reverse.

    Args:
        picture: uint8 (256, 256, 3).
        is_object: (classes, *GRID) whether an object of the class is in the cell.
        scores: (classes, *GRID) probability that one is.
        details: (4, *GRID) as `ObjectDetector.forward` returns them.
    """
    classes, rows, columns = torch.nonzero(is_object, as_tuple=True)
    surest = scores[classes, rows, columns].argsort(descending=True)[:MOST_OBJECTS]
    rows = rows[surest]
    columns = columns[surest]
    cell_details = details[:, rows, columns].numpy().T  # (n, 4)
    cell_corners = np.stack([columns, rows], 1)
    points = (cell_corners + cell_details[:, :2]) * CELL + TABLE_CORNER
    yaw_codes = cell_details[:, 2:].astype(np.float32)
    return LabeledPicture(picture, classes[surest].numpy(), points, yaw_codes)


def augmented(view: LabeledPicture, rng: np.random.Generator) -> LabeledPicture:
    """Return a picture shifted at random, and mirrored half the time, with its labels.

    A few scenes show each object in a few places only, and a detector learns those by heart.
    """
    down, right = rng.integers(-MOST_SHIFT, MOST_SHIFT + 1, 2).tolist()
    shifted = _shifted(view, down, right)
    is_mirrored = rng.random() < MIRRORED
    return _mirrored(shifted) if is_mirrored else shifted


def _shifted(view: LabeledPicture, down: int, right: int) -> LabeledPicture:
    """Return a picture shifted down and right, in pixels; repeated border pixels fill the gap."""
    height, width = view.picture.shape[:2]
    rows = np.clip(np.arange(height) - down, 0, height - 1)
    columns = np.clip(np.arange(width) - right, 0, width - 1)
    points = view.points + np.array([right, down])
    return view._replace(picture=view.picture[rows][:, columns], points=points)


def _mirrored(view: LabeledPicture) -> LabeledPicture:
    """Return a picture with left and right exchanged, and its labels with it.

    A point at column 10 of 256 comes to column 246. Angles turn the other way, so that the sines of
    yaw codes change sign and the cosines do not.
    """
    width = view.picture.shape[1]
    points = np.array([width, 0.0]) + view.points * np.array([-1.0, 1.0])
    yaw_codes = view.yaw_codes * np.array([1.0, -1.0], np.float32)
    return view._replace(picture=view.picture[:, ::-1], points=points, yaw_codes=yaw_codes)


def detector_loss(net: ObjectDetector, views: Sequence[LabeledPicture]) -> Tensor:
    """Return the loss of a batch of labeled pictures, per object in them.

    It adds the cross-entropy of the classes in all cells, and the distances of point and angle in
    cells with an object. Such cells are rare, so their classes weigh `PRESENT_WEIGHT` times as
    much.
    """
    logits, details = net(torch.from_numpy(np.stack([view.picture for view in views])))
    is_there = torch.zeros_like(logits)
    right_details = torch.zeros_like(details)
    for number, view in enumerate(views):
        _label_cells(view, is_there[number], right_details[number])
    weights = torch.where(is_there > 0, PRESENT_WEIGHT, 1.0)
    score_loss = functional.binary_cross_entropy_with_logits(
        logits, is_there, weights, reduction="sum"
    )

    has_object = is_there.amax(1, keepdim=True)  # (n, 1, *GRID), of any class
    distances = functional.l1_loss(details, right_details, reduction="none")
    detail_loss = (distances * has_object).sum()
    object_count = is_there.sum().clamp(min=1.0)
    return (score_loss / PRESENT_WEIGHT + detail_loss) / object_count


def _label_cells(view: LabeledPicture, is_there: Tensor, details: Tensor) -> None:
    """Write the labels of one picture into its grids of zeros, in place; `_objects_in` reads such.

    Objects outside of the grid are left out; of two in one cell the later one's details count.

    Args:
        view: the labeled picture.
        is_there: (classes, *GRID) becomes 1 where an object of the class is.
        details: (4, *GRID) becomes column and row of the object's origin from the corner of its
            cell, in cells, and its yaw code.
    """
    cells = (view.points - TABLE_CORNER) / CELL
    for class_number, (x, y), yaw_code in zip(view.classes, cells, view.yaw_codes, strict=True):
        if 0 <= y < GRID[0] and 0 <= x < GRID[1]:
            row = int(y)
            column = int(x)
            is_there[int(class_number), row, column] = 1.0
            details[:, row, column] = torch.tensor([x - column, y - row, *yaw_code])
