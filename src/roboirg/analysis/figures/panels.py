"""Panels of a figure, each with the same labeled rows, above one legend and the notes.

Texts come first: they are folded into lines, and the height of the figure is the room that these
lines take, in inches.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from roboirg.analysis.figures.figure_style import (
    PAGE_INCHES,
    SMALL_POINTS,
    TITLE_POINTS,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMN_INCHES = 3.4
"""Width of a column of a page."""
ROW_LINE_INCHES = 0.12
NOTE_LINE_INCHES = 0.125
KEY_LINE_INCHES = 0.17
TITLE_LINE_INCHES = 0.15
"""Heights of a line of a row's label, a note, the legend and a panel's title."""
AXIS_INCHES = 0.45
"""Height of what is below a panel."""
MOST_ROW_LETTERS = 28
"""Letters of a line of a row's label."""
ROW_LETTERS = 13
TITLE_LETTERS = 10
NOTE_LETTERS = 18
KEY_LETTERS = 18
"""Letters that fit into an inch of a row's label, a panel's title, a note and the legend."""
MOST_TITLE_SHRINKING = 1.4
"""By which factor a panel's title may be smaller so that its longest word fits."""
KEY_SIGN_LETTERS = 5
MOST_KEY_COLUMNS = 4


class Panel(NamedTuple):
    """A panel of a figure.

    Attributes:
        axes: of the panel.
        places: vertical positions of the centers of its rows, in units, from the top down. A row
            is two units high, and one more for every further line of its label.
    """

    axes: Axes
    places: list[float]

    def set_scale(self, end: int, tick: int, label: str, margin: float = 0) -> None:
        """Set the horizontal scale, from 0 to a whole end.

        Args:
            end: of the scale.
            tick: distance between numbers.
            label: below the scale.
            margin: room at both ends, as a share of the scale.
        """
        self.axes.set_xlim(-margin * end, (1 + margin) * end)
        self.axes.set_xticks(range(0, end + 1, tick))
        self.axes.set_xlabel(label, fontsize=SMALL_POINTS)


class RowLabel(NamedTuple):
    """What stands before a row; headings are bold."""

    text: str
    is_heading: bool = False


def panels(
    titles: Sequence[str],
    labels: Sequence[RowLabel],
    most_across: int,
    keys: Mapping[str, Artist],
    notes: Sequence[str],
) -> tuple[Figure, list[Panel]]:
    """Lay out a figure: a grid of empty panels with the same rows; legend and notes below them.

    The height of the figure follows from its content.

    Args:
        titles: of the panels, one for each.
        labels: of the rows that each panel has, from the top down.
        most_across: most panels side by side; one alone has the width of a column, several of a
            page.
        keys: what the legend explains, by label.
        notes: sentences, each in lines of its own.
    """
    across = min(most_across, len(titles))
    down = math.ceil(len(titles) / across)
    width = PAGE_INCHES if across > 1 else COLUMN_INCHES
    rows = _Rows.folded(labels)
    panel_titles = _Titles.fitted(titles, (width - rows.label_inches) / across)
    footer = _Footer.folded(keys, notes, width)

    panel_inches = panel_titles.inches + rows.inches + AXIS_INCHES
    height = down * panel_inches + footer.inches
    figure = new_figure(width, height, footer.inches / height)
    drawn = []
    for axes in _titled_axes(figure, down, across, panel_titles):
        drawn.append(Panel(axes, rows.draw(axes)))
    footer.draw(figure)
    return figure, drawn


def _titled_axes(figure: Figure, down: int, across: int, titles: _Titles) -> list[Axes]:
    """Add a grid of axes to a figure, `down` times `across`; return those with a title.

    Places of the grid that are left over stay empty.
    """
    grid = figure.subplots(down, across, sharey=True, squeeze=False).ravel()
    shown = list(grid[: len(titles.texts)])
    for axes, title in zip(shown, titles.texts, strict=True):
        axes.set_title(title, loc="left").set_size(titles.points)
        _clear_axes(axes)
    for unused in grid[len(shown) :]:
        unused.set_visible(False)
    return shown


def _clear_axes(axes: Axes) -> None:
    """Remove most of the frame and add vertical grid lines."""
    axes.set_axisbelow(True)
    axes.grid(axis="x")
    axes.tick_params(length=0)
    axes.spines[["top", "right", "left"]].set_visible(False)


class _Rows(NamedTuple):
    """The rows of a panel from the top down, by their labels, which are folded into lines."""

    labels: list[RowLabel]

    @classmethod
    def folded(cls, labels: Sequence[RowLabel]) -> _Rows:
        return cls([label._replace(text=_folded(label.text, MOST_ROW_LETTERS)) for label in labels])

    @property
    def label_inches(self) -> float:
        """The width of the longest line of the labels."""
        longest = 0
        for label in self.labels:
            longest = max(longest, *map(len, label.text.split("\n")))
        return longest / ROW_LETTERS

    @property
    def units(self) -> list[int]:
        """The height of each row: two for a label of one line, three for two lines."""
        return [label.text.count("\n") + 2 for label in self.labels]

    @property
    def inches(self) -> float:
        """The height of all rows."""
        return ROW_LINE_INCHES * sum(self.units)

    def draw(self, axes: Axes) -> list[float]:
        """Label the rows of a panel at its left; return the vertical positions of their centers.

        Positions are in units of the axis, from the top down: of two rows, of 2 and 3 units, at 1
        and 3.5.
        """
        places = []
        top = 0
        for units in self.units:
            places.append(top + units / 2)
            top += units
        axes.set_ylim(top, 0)
        axes.set_yticks(places, [label.text for label in self.labels])
        # All labels or none, as only the panels on the left show them.
        for tick, label in zip(axes.get_yticklabels(), self.labels, strict=False):
            tick.set_fontweight("bold" if label.is_heading else "normal")
        return places


class _Titles(NamedTuple):
    """Titles of panels, folded into lines, and the size of their letters."""

    texts: list[str]
    points: float

    @classmethod
    def fitted(cls, titles: Sequence[str], inches: float) -> _Titles:
        """Fold titles into lines that fit into the width of a panel, in inches.

        If a word is too long for a line, all titles are drawn smaller, down to a limit at which the
        word is broken.
        """
        fitting = TITLE_LETTERS * inches  # letters of the usual size in a line
        longest_word = 0
        for title in titles:
            longest_word = max(longest_word, *map(len, title.split()))
        letters = min(max(fitting, longest_word), fitting * MOST_TITLE_SHRINKING)
        return cls([_folded(title, letters) for title in titles], TITLE_POINTS * fitting / letters)

    @property
    def inches(self) -> float:
        """The height of the longest title."""
        return TITLE_LINE_INCHES * max(title.count("\n") + 1 for title in self.texts)


class _Footer(NamedTuple):
    """What is below all panels: the legend, and below it the notes.

    Attributes:
        keys: what the legend explains, by label.
        notes: folded into lines.
        width: of the figure, inches.
    """

    keys: Mapping[str, Artist]
    notes: str
    width: float

    @classmethod
    def folded(cls, keys: Mapping[str, Artist], notes: Sequence[str], width: float) -> _Footer:
        letters = NOTE_LETTERS * width
        return cls(keys, "\n".join(_folded(note, letters) for note in notes), width)

    @property
    def key_columns(self) -> int:
        """How many columns the legend has."""
        letters = max(map(len, self.keys), default=0) + KEY_SIGN_LETTERS
        fitting = int(KEY_LETTERS * self.width) // letters
        return max(1, min(MOST_KEY_COLUMNS, fitting))

    @property
    def note_inches(self) -> float:
        """The height of the notes with a line of room around them."""
        return NOTE_LINE_INCHES * (self.notes.count("\n") + 2)

    @property
    def inches(self) -> float:
        """The height of the notes, and of the legend with half a line of room."""
        key_lines = math.ceil(len(self.keys) / self.key_columns)
        return self.note_inches + KEY_LINE_INCHES * (key_lines + 0.5)

    def draw(self, figure: Figure) -> None:
        height = figure.get_figheight()
        figure.legend(
            self.keys.values(),
            self.keys,
            loc="lower center",
            bbox_to_anchor=(0.5, self.note_inches / height),
            ncols=self.key_columns,
            columnspacing=1.2,
            handletextpad=0.7,
            borderaxespad=0,
            borderpad=0,
        )
        bottom = 0.5 * NOTE_LINE_INCHES / height
        figure.text(0.012, bottom, self.notes, fontsize=SMALL_POINTS, va="bottom")


def _folded(text: str, letters: float) -> str:
    """Return a text in lines of at most `letters` letters."""
    return textwrap.fill(text, int(letters), break_on_hyphens=False)
