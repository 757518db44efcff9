"""An episode as a strip of pictures: what was said, and what was done when."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from roboirg.analysis.figures.figure_style import PAGE_INCHES, first_color, ghost
from roboirg.core.observations import Pixels
from roboirg.util.media import CONTROL_RATE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PER_ROW = 6
"""Moments per row."""

_FEWEST_COLUMNS = 4
"""Pictures of fewer moments are no larger."""

# Lengths in inches.
_EDGE = 0.08
_GAP = 0.06
_TITLE = 0.26
_LINE = 0.135
_CAPTION_LINE = 0.11
_ROW_GAP = 0.16
_WORDS_AT = 0.85
"""Left end of what is said."""

_CAPTION_LINES = 4
"""Most lines of a caption."""
_WORD_LETTERS = 122
"""Letters of a line of words."""
_CAPTION_LETTERS = 24 / 1.09
"""Letters of an inch of a caption."""
_SPACING = 1.15
"""Distance of lines, in heights of the letters."""
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

    @property
    def lines(self) -> list[str]:
        """The words in lines of the sheet's width."""
        return textwrap.wrap(self.words, _WORD_LETTERS) or [""]


def draw_strip(title: str, said: Sequence[SpokenSetting], moments: Sequence[StripMoment]) -> Figure:
    """Return a figure with the words above all moments of an episode, in order of time.

    Args:
        title: one line.
        said: the instructions of the settings to show.
        moments: at least one.
    """
    from matplotlib.figure import Figure

    words_top = _EDGE + _TITLE
    words_height = _LINE * sum(len(spoken.lines) for spoken in said)
    grid = _Grid(moments, words_top + words_height)
    figure = Figure(figsize=(PAGE_INCHES, grid.bottom))

    _write(figure, _EDGE, _EDGE, title, fontsize=9, fontweight="bold")
    y = words_top
    for spoken in said:
        _write_spoken(figure, y, spoken)
        y += _LINE * len(spoken.lines)
    for number, moment in enumerate(moments):
        x, y = grid.corner(number)
        _draw_moment(figure, x, y, moment, grid.side)

    _name_sides(figure.axes[0])
    return figure


def _name_sides(axes: Axes) -> None:
    """Write the robot's right and left into a picture: the front camera faces the robot."""
    style = {**_SIDE, "transform": axes.transAxes}
    axes.text(0.03, 0.04, "robot's right", **style)
    axes.text(0.97, 0.04, "robot's left", ha="right", **style)


@dataclass(frozen=True, eq=False)
class _Grid:
    """Places of moments in rows; lengths in inches, from the upper left corner.

    Attributes:
        moments: what is shown.
        top: upper end of the first row.
    """

    moments: Sequence[StripMoment]
    top: float

    @property
    def rows(self) -> int:
        """Number of rows of pictures."""
        return math.ceil(len(self.moments) / PER_ROW)

    @property
    def columns(self) -> int:
        """Moments in a row; rows are equally long: eight moments become four and four."""
        return max(math.ceil(len(self.moments) / self.rows), _FEWEST_COLUMNS)

    @property
    def side(self) -> float:
        """Width and height of a picture."""
        return (PAGE_INCHES - 2 * _EDGE - (self.columns - 1) * _GAP) / self.columns

    @property
    def row_height(self) -> float:
        """Height of a picture with its time and its caption."""
        lines = max(len(_caption_lines(moment, self.side)) for moment in self.moments)
        return self.side + _GAP + (lines + 1) * _CAPTION_LINE + _ROW_GAP

    @property
    def bottom(self) -> float:
        """Lower end of the last row."""
        return self.top + self.rows * self.row_height

    def corner(self, number: int) -> tuple[float, float]:
        """Return the upper left corner of a picture, x and y."""
        row, column = divmod(number, self.columns)
        x = _EDGE + column * (self.side + _GAP)
        y = self.top + row * self.row_height + _EDGE
        return x, y


def _caption_lines(moment: StripMoment, width: float) -> list[str]:
    """Return the first lines of a caption below a picture of some width, inches."""
    return textwrap.wrap(moment.caption, int(_CAPTION_LETTERS * width))[:_CAPTION_LINES]


def _write(figure: Figure, x: float, y: float, text: str, **style: Any) -> None:  # noqa: ANN401
    """Write below a point, in inches from the upper left corner; `style` is matplotlib's."""
    figure.text(x / PAGE_INCHES, 1 - y / figure.get_figheight(), text, va="top", **style)


def _write_spoken(figure: Figure, y: float, spoken: SpokenSetting) -> None:
    """Write a setting and what is said in it."""
    # Black is for light pages alone.
    color = None if spoken.color == _BLACK else spoken.color
    _write(figure, _EDGE, y, spoken.setting, color=color, fontweight="bold", fontsize=7)
    _write(figure, _WORDS_AT, y, "\n".join(spoken.lines), fontsize=7, linespacing=_SPACING)


def _draw_moment(figure: Figure, x: float, y: float, moment: StripMoment, side: float) -> None:
    """Draw a picture below a point and write when it was and what had happened.

    Args:
        figure: that has the picture.
        x: left end of the picture, inches from the left.
        y: upper end of the picture, inches from the top.
        moment: what is drawn.
        side: width and height of the picture, inches.
    """
    height = figure.get_figheight()
    bottom = 1 - (y + side) / height  # matplotlib measures from below, in shares of the figure
    axes = figure.add_axes((x / PAGE_INCHES, bottom, side / PAGE_INCHES, side / height))
    axes.imshow(moment.picture, interpolation="antialiased")
    axes.set_axis_off()

    when = f"{moment.step / CONTROL_RATE:.1f} s"
    color = ghost()
    if moment.is_demonstration:
        when += ", video"
        color = first_color()
    y += side + _GAP
    _write(figure, x, y, when, fontsize=6, color=color, fontweight="bold")
    caption = "\n".join(_caption_lines(moment, side))
    _write(figure, x, y + _CAPTION_LINE, caption, fontsize=6, linespacing=_SPACING)
