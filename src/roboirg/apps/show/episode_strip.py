"""An episode as a strip of pictures: what was said, and what was done when."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from roboirg.core.observations import Pixels
from roboirg.evaluation.analysis.figures.figure_style import PAGE_INCHES
from roboirg.util.media import CONTROL_RATE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PER_ROW = 6
"""Moments per row."""

_EDGE, _GAP = 0.08, 0.06
_TITLE, _LINE = 0.26, 0.135
_CAPTION_LINES, _CAPTION_LINE = 4, 0.11
"""Lengths in inches."""
_WORDS_AT = 0.85
"""Left end of what is said, inches."""
_WORD_LETTERS, _CAPTION_LETTERS = 122, 24 / 1.09
"""Letters of a line of words, and of an inch of a caption."""
_VIDEO = "#E69F00"
_PALE = "#8a8a8a"
_BLACK = "#000000"
_SIDE: Mapping[str, Any] = {"fontsize": 5.5, "color": "white"}


@dataclass(frozen=True, eq=False)
class StripMoment:
    """One moment of an episode.

    Attributes:
        step: control steps since reset.
        caption: what has just happened.
        picture: of the front camera, RGB, uint8 (256, 256, 3).
        is_demonstration: whether it belongs to the video, which is marked.
    """

    step: int
    caption: str
    picture: Pixels
    is_demonstration: bool = False


class SpokenSetting(NamedTuple):
    """An instruction, its setting, and the setting's color."""

    setting: str
    words: str
    color: str


def draw_strip(title: str, said: Sequence[SpokenSetting], moments: Sequence[StripMoment]) -> Figure:
    """Draw the words above all moments, in order of time.

    Args:
        title: one line.
        said: the instructions of the settings to show.
        moments: at least one.
    """
    from matplotlib.figure import Figure

    # Rows of equal length: eight moments become four and four.
    rows = math.ceil(len(moments) / PER_ROW)
    columns = max(math.ceil(len(moments) / rows), 4)
    size = (PAGE_INCHES - 2 * _EDGE - (columns - 1) * _GAP) / columns
    words = [textwrap.wrap(one.words, _WORD_LETTERS) or [""] for one in said]
    head = _EDGE + _TITLE + _LINE * sum(map(len, words))
    letters = int(_CAPTION_LETTERS * size)
    captions = [textwrap.wrap(one.caption, letters) for one in moments]
    most = min(_CAPTION_LINES, max(map(len, captions)))
    row = size + _GAP + (most + 1) * _CAPTION_LINE + 0.16
    height = head + rows * row
    figure = Figure(figsize=(PAGE_INCHES, height))

    def write(x: float, y: float, text: str, **style: Any) -> None:  # noqa: ANN401
        """Write below a point, in inches from the upper left corner."""
        figure.text(x / PAGE_INCHES, 1 - y / height, text, va="top", **style)

    write(_EDGE, _EDGE, title, fontsize=9, fontweight="bold")
    y = _EDGE + _TITLE
    for one, lines in zip(said, words, strict=True):
        color = None if one.color == _BLACK else one.color  # black is for light pages alone
        write(_EDGE, y, one.setting, color=color, fontweight="bold", fontsize=7)
        write(_WORDS_AT, y, "\n".join(lines), fontsize=7, linespacing=1.15)
        y += _LINE * len(lines)
    for index, (moment, caption) in enumerate(zip(moments, captions, strict=True)):
        number, column = divmod(index, columns)
        x, y = _EDGE + column * (size + _GAP), head + number * row + 0.08
        bottom = 1 - (y + size) / height
        axes = figure.add_axes((x / PAGE_INCHES, bottom, size / PAGE_INCHES, size / height))
        axes.imshow(moment.picture, interpolation="antialiased")
        axes.set_axis_off()
        if not index:  # the front camera faces the robot
            axes.text(0.03, 0.04, "robot's right", transform=axes.transAxes, **_SIDE)
            axes.text(0.97, 0.04, "robot's left", transform=axes.transAxes, ha="right", **_SIDE)
        y += size + _GAP
        when = f"{moment.step / CONTROL_RATE:.1f} s"
        when += ", video" if moment.is_demonstration else ""
        color = _VIDEO if moment.is_demonstration else _PALE
        write(x, y, when, fontsize=6, color=color, fontweight="bold")
        write(x, y + _CAPTION_LINE, "\n".join(caption[:most]), fontsize=6, linespacing=1.15)
    return figure
