"""How a body learned: its decisions after each pass, as data and as a figure."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from roboirg.util.atomic_write import write_atomically

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEIGHT_INCHES = 2.2
SHOWN = {"moves": "kind of waypoint", "things": "thing", "done": "completed stages"}
"""What the figure calls the shares."""


class BodyScore(NamedTuple):
    """How many decisions a body makes as the expert does.

    Attributes:
        epoch: passes so far.
        loss: mean over batches of episodes that it learned from.
        moves: share of right kinds of waypoints in episodes held back.
        things: share of right things in them, given the kind.
        done: share of right numbers of completed stages in them.
    """

    epoch: int
    loss: float
    moves: float
    things: float
    done: float


def save_curve(scores: Sequence[BodyScore], path: Path) -> None:
    """Write the curve next to a body's file: as JSON, and as a figure where Matplotlib is there."""
    content = json.dumps([one._asdict() for one in scores])
    write_atomically(path.with_suffix(".json"), content)
    if importlib.util.find_spec("matplotlib") is not None:
        from roboirg.evaluation.analysis.figures.figure_style import save

        save(partial(_draw, scores), path.parent, path.stem)


def _draw(scores: Sequence[BodyScore]) -> Figure:
    from roboirg.evaluation.analysis.figures.figure_style import (
        COLORS,
        COLUMN_INCHES,
        clear_axes,
        new_figure,
    )

    figure = new_figure(COLUMN_INCHES, HEIGHT_INCHES)
    axes = figure.subplots()
    clear_axes(axes, grid="y")
    epochs = [one.epoch for one in scores]
    for (name, label), color in zip(SHOWN.items(), COLORS, strict=False):
        axes.plot(epochs, [100.0 * getattr(one, name) for one in scores], label=label, color=color)
    axes.set_xlabel("passes over all episodes")
    axes.set_ylabel("right in episodes held back, %")
    axes.legend()
    return figure
