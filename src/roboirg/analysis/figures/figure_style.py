"""Style of all figures: sizes, colors, signs, and file formats."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from roboirg.core.extras import extra_needed
from roboirg.util.atomic_write import replacing

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMN_INCHES = 3.4
PAGE_INCHES = 7.0
"""Widths of a column and of a page; figures are drawn at final size."""
ROW_LINE_INCHES = 0.115
NOTE_LINE_INCHES = 0.11
KEY_LINE_INCHES = 0.16
TITLE_LINE_INCHES = 0.14
"""Heights of a line of a row's label, a note, the legend and a panel's title."""
AXIS_INCHES = 0.4
"""Height of what is below a panel."""
MOST_ROW_LETTERS = 28
"""Letters of a line of a row's label."""
ROW_LETTERS = 14
TITLE_LETTERS = 10
NOTE_LETTERS = 21
KEY_LETTERS = 19
"""Letters that fit into an inch of a row's label, a panel's title, a note and the legend."""
TITLE_POINTS = 8.5
MOST_TITLE_SHRINKING = 1.4
"""Size of a panel's title, and by which factor it may be smaller so that its longest word fits."""
KEY_SIGN_LETTERS = 5
MOST_KEY_COLUMNS = 4
DOTS_PER_INCH = 300
STYLE = {
    "font.size": 7.5,
    "axes.linewidth": 0.6,
    "axes.edgecolor": "#999999",
    "axes.titlesize": TITLE_POINTS,
    "axes.titleweight": "bold",
    "lines.color": "#0072B2",
    "grid.color": "#dddddd",
    "grid.linewidth": 0.5,
    "legend.frameon": False,
    "legend.fontsize": 7,
}
DARK_PAPER = "#0d1117"
DARK_INK = "#e6edf3"
DARK_STYLE = {
    **STYLE,
    "figure.facecolor": DARK_PAPER,
    "savefig.facecolor": DARK_PAPER,
    "axes.facecolor": DARK_PAPER,
    "axes.edgecolor": "#6e7681",
    "lines.color": "#56B4E9",
    "grid.color": "#30363d",
    **dict.fromkeys(
        ("text.color", "axes.labelcolor", "xtick.color", "ytick.color", "axes.titlecolor"), DARK_INK
    ),
}
"""For pages with a dark background."""
_METADATA = {
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
    "png": None,
}
_SAME_FILES = {
    "font.family": "DejaVu Sans",
    "pdf.fonttype": 42,  # letters, not outlines, which some venues refuse
    "svg.hashsalt": "roboirg",  # the ids in an SVG file are random without it
}
GHOST = "#8a8a8a"
"""Of what is published and of what only explains."""


def check_figure_support() -> None:
    """Check early that figures can be drawn."""
    with extra_needed("Figures need matplotlib", "report"):
        import matplotlib as mpl  # noqa: F401


def save(
    draw: Callable[[], Figure | None],
    folder: Path,
    name: str,
    formats: Sequence[str] = ("png", "svg", "pdf"),
) -> tuple[Path, ...]:
    """Draw a figure in the common style and write it in some formats, and for dark pages.

    Equal figures give equal files. Those for dark pages end in ``-dark`` and have no PDF; `name`
    has no extension, and the folder is created if it is missing. Without a figure no file is
    written.
    """
    check_figure_support()
    paths = _save_in_style(draw, folder, name, STYLE, formats)
    if paths:
        on_dark = [ending for ending in formats if ending != "pdf"]
        paths += _save_in_style(draw, folder, f"{name}-dark", DARK_STYLE, on_dark)
    return tuple(paths)


def _save_in_style(
    draw: Callable[[], Figure | None],
    folder: Path,
    stem: str,
    style: Mapping[str, object],
    formats: Sequence[str],
) -> list[Path]:
    """Draw a figure in a style, write it in some formats, and return the files."""
    import matplotlib as mpl

    with mpl.rc_context(cast("Any", {**_SAME_FILES, **style})):
        figure = draw()
        if figure is None:
            return []
        _fix_layout(figure)
        paths = []
        for ending in formats:
            path = folder / f"{stem}.{ending}"
            metadata = _METADATA[ending]
            with replacing(path) as part:
                figure.savefig(part, format=ending, dpi=DOTS_PER_INCH, metadata=metadata)
            paths.append(path)
    return paths


def _fix_layout(figure: Figure) -> None:
    """Place the axes as laid out, but rounded to four digits.

    The last digits of a layout differ each time, and so would the files.
    """
    figure.set_dpi(DOTS_PER_INCH)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axes in figure.axes:
        left, bottom, width, height = (round(side, 4) for side in axes.get_position().bounds)
        axes.set_position((left, bottom, width, height))


def paper() -> str:
    """Return the color of the page that is being drawn."""
    import matplotlib as mpl

    return str(mpl.rcParams["axes.facecolor"])


def first_color() -> str:
    """Return the first of the colors, which is a lighter blue on dark pages."""
    import matplotlib as mpl

    return str(mpl.rcParams["lines.color"])


def new_figure(width: float, height: float, below: float = 0) -> Figure:
    """Return an empty figure of the given size in inches, with a share of it left free below."""
    # Without pyplot, which keeps every figure and looks for a display.
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    engine = ConstrainedLayoutEngine(
        w_pad=0.03, h_pad=0.03, wspace=0.04, rect=(0, below, 1, 1 - below)
    )
    return Figure(figsize=(width, height), layout=engine)


def _clear_axes(axes: Axes) -> None:
    """Remove most of the frame and add vertical grid lines."""
    axes.set_axisbelow(True)
    axes.grid(axis="x")
    axes.tick_params(axis="both", length=0)
    axes.spines[["top", "right", "left"]].set_visible(False)


def folded(text: str, letters: float) -> str:
    """Return a text in lines of at most `letters` letters."""
    return textwrap.fill(text, int(letters), break_on_hyphens=False)


class Panel(NamedTuple):
    """A panel of a figure.

    Attributes:
        axes: of the panel.
        places: vertical positions of its rows, each of which is two units high, and one more for
            every further line of its label.
    """

    axes: Axes
    places: list[float]


class _Titles(NamedTuple):
    """Titles of panels, folded into lines, and the size of their letters."""

    texts: list[str]
    points: float


def panels(
    titles: Sequence[str],
    labels: Sequence[str],
    most_across: int,
    keys: Mapping[str, Artist],
    notes: Sequence[str],
    *,
    headings: Collection[str] = (),
) -> tuple[Figure, list[Panel]]:
    """Return a new figure and its panels; below them are its keys and then its notes.

    Args:
        titles: of the panels.
        labels: of the rows that each panel has, from the top down.
        most_across: most panels side by side; one alone has the width of a column, several of a
            page.
        keys: what the legend explains, by label.
        notes: sentences, each in lines of its own.
        headings: labels in bold.
    """
    across = min(most_across, len(titles))
    down = math.ceil(len(titles) / across)
    width = PAGE_INCHES if across > 1 else COLUMN_INCHES

    # Texts first, because the height of the figure depends on their lines.
    row_labels = [folded(label, MOST_ROW_LETTERS) for label in labels]
    panel_inches = (width - _label_inches(row_labels)) / across
    panel_titles = _fitted(titles, panel_inches)
    note_text = "\n".join(folded(note, NOTE_LETTERS * width) for note in notes)

    below = _note_inches(note_text) + _key_inches(keys, width)
    height = down * _panel_inches(row_labels, panel_titles) + below
    figure = new_figure(width, height, below / height)

    drawn = []
    for axes in _titled_axes(figure, down, across, panel_titles):
        drawn.append(Panel(axes, _label_rows(axes, row_labels, headings)))
    _explain(figure, keys, note_text)
    return figure, drawn


def _note_inches(text: str) -> float:
    """Return the height of the notes with a line of room around them."""
    return NOTE_LINE_INCHES * (text.count("\n") + 2)


def _key_inches(keys: Collection[str], width: float) -> float:
    """Return the height of the legend with half a line of room."""
    lines = math.ceil(len(keys) / _key_columns(keys, width))
    return KEY_LINE_INCHES * (lines + 0.5)


def _titled_axes(figure: Figure, down: int, across: int, titles: _Titles) -> list[Axes]:
    """Return the axes of each panel, with its title, in a grid of `down` times `across` places."""
    grid = figure.subplots(down, across, sharey=True, squeeze=False).ravel()
    shown = list(grid[: len(titles.texts)])
    for axes, title in zip(shown, titles.texts, strict=True):
        axes.set_title(title, loc="left").set_size(titles.points)
        _clear_axes(axes)
    for unused in grid[len(shown) :]:
        unused.set_visible(False)
    return shown


def _panel_inches(rows: Sequence[str], titles: _Titles) -> float:
    """Return the height of a panel with its title and what is below it."""
    title_lines = max(title.count("\n") + 1 for title in titles.texts)
    rows_inches = ROW_LINE_INCHES * sum(map(_units, rows))
    return rows_inches + TITLE_LINE_INCHES * title_lines + AXIS_INCHES


def _label_inches(rows: Sequence[str]) -> float:
    """Return the width of the longest line of the labels."""
    longest = 0
    for row in rows:
        longest = max(longest, *map(len, row.split("\n")))
    return longest / ROW_LETTERS


def _fitted(titles: Sequence[str], inches: float) -> _Titles:
    """Return titles in lines that fit into the width of a panel, in inches.

    A long word, such as a setting's name, is drawn smaller rather than broken, and the other words
    of all titles with it.
    """
    fitting = TITLE_LETTERS * inches  # letters of the usual size in a line
    longest_word = 0
    for title in titles:
        longest_word = max(longest_word, *map(len, title.split()))
    letters = min(max(fitting, longest_word), fitting * MOST_TITLE_SHRINKING)
    return _Titles([folded(title, letters) for title in titles], TITLE_POINTS * fitting / letters)


def _key_columns(keys: Collection[str], width: float) -> int:
    """Return how many columns the legend has in a figure of a width in inches."""
    letters = max(map(len, keys), default=0) + KEY_SIGN_LETTERS
    fitting = int(KEY_LETTERS * width) // letters
    return max(1, min(MOST_KEY_COLUMNS, fitting))


def _explain(figure: Figure, keys: Mapping[str, Artist], text: str) -> None:
    """Explain the keys below the panels, and below them write the notes."""
    width, height = figure.get_size_inches()
    figure.legend(
        keys.values(),
        keys,
        loc="lower center",
        bbox_to_anchor=(0.5, _note_inches(text) / height),
        ncols=_key_columns(keys, width),
        columnspacing=1.2,
        handletextpad=0.7,
        borderaxespad=0,
        borderpad=0,
    )
    figure.text(0.01, 0.5 * NOTE_LINE_INCHES / height, text, fontsize=6, va="bottom")


def _units(label: str) -> int:
    """Return the height of a row: two units for a label of one line, three for two lines."""
    return label.count("\n") + 2


def _label_rows(axes: Axes, labels: Sequence[str], headings: Collection[str]) -> list[float]:
    """Label rows from the top down; return the positions of their centers.

    Two rows, of labels with one line and with two, are at 1 and 3.5 units below the top.
    """
    places = []
    top = 0
    for label in labels:
        places.append(top + _units(label) / 2)
        top += _units(label)
    axes.set_ylim(top, 0)
    axes.set_yticks(places, labels)
    for tick in axes.get_yticklabels():
        is_heading = tick.get_text() in headings
        tick.set_fontweight("bold" if is_heading else "normal")
    return places
