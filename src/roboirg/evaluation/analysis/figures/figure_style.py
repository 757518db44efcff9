"""Style of all figures: sizes, colors, signs, and file formats."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from roboirg.core.extras import extra_needed
from roboirg.util.atomic_write import replacing

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMN_INCHES, PAGE_INCHES = 3.4, 7.0
"""Widths of a column and of a page; figures are drawn at final size."""
ROW_LINE_INCHES, NOTE_LINE_INCHES, KEY_LINE_INCHES, TITLE_LINE_INCHES = 0.115, 0.11, 0.16, 0.14
"""Heights of a line of a row, a note, the legend and a panel's title."""
AXIS_INCHES = 0.4
"""Height of what is below a panel."""
MOST_ROW_LETTERS = 28
"""Letters of a line of a row's label."""
ROW_LETTERS, TITLE_LETTERS, NOTE_LETTERS, KEY_LETTERS = 14, 10, 21, 19
"""Letters that fit into an inch of a row's label, a panel's title, a note and the legend."""
TITLE_POINTS, MOST_TITLE_SHRINKING = 8.5, 1.4
"""Size of a panel's title, and by which factor it may be smaller so that its longest word fits."""
KEY_SIGN_LETTERS, MOST_KEY_COLUMNS = 5, 4
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
DARK_PAPER, DARK_INK = "#0d1117", "#e6edf3"
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
    import matplotlib as mpl

    paths: list[Path] = []
    on_dark = [one for one in formats if one != "pdf"]
    for stem, style, own in ((name, STYLE, formats), (f"{name}-dark", DARK_STYLE, on_dark)):
        with mpl.rc_context(cast("Any", {**_SAME_FILES, **style})):
            figure = draw()
            if figure is None:
                return ()
            _fix_layout(figure)
            for ending in own:
                path = folder / f"{stem}.{ending}"
                with replacing(path) as part:
                    figure.savefig(
                        part, format=ending, dpi=DOTS_PER_INCH, metadata=_METADATA[ending]
                    )
                paths.append(path)
    return tuple(paths)


def _fix_layout(figure: Figure) -> None:
    """Place the axes as laid out, but rounded: the last digits differ each time."""
    figure.set_dpi(DOTS_PER_INCH)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axes in figure.axes:
        left, bottom, width, height = (round(one, 4) for one in axes.get_position().bounds)
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


def panels(
    rows: Mapping[str, Sequence[str]],
    across: int,
    keys: Mapping[str, Artist],
    notes: Sequence[str],
    *,
    headings: Collection[str] = (),
) -> tuple[Figure, list[tuple[Axes, list[float]]]]:
    """Return a new figure and its panels; below them are its keys and then its notes.

    Args:
        rows: title of each panel and the labels of its rows, from the top down.
        across: most panels side by side; one alone has the width of a column, several of a page.
        keys: what the legend explains, by label.
        notes: sentences, each in lines of its own.
        headings: labels in bold.

    Returns:
        The figure, and of each panel the axes and the vertical positions of its rows, each of
        which is two units high, and one more for every further line of its label.
    """
    across = min(across, len(rows))
    down = -(-len(rows) // across)
    width = PAGE_INCHES if across > 1 else COLUMN_INCHES
    labels = [[folded(label, MOST_ROW_LETTERS) for label in own] for own in rows.values()]
    longest = max(len(line) for own in labels for label in own for line in label.split("\n"))
    room = (width - longest / ROW_LETTERS) / across
    fitting = TITLE_LETTERS * room
    longest_word = max(len(word) for title in rows for word in title.split())
    # A long word, such as a setting's name, is drawn smaller rather than broken.
    letters = min(max(fitting, longest_word), fitting * MOST_TITLE_SHRINKING)
    titles = [folded(title, letters) for title in rows]
    sizes = [[label.count("\n") + 2 for label in own] for own in labels]
    text = "\n".join(folded(note, NOTE_LETTERS * width) for note in notes)
    key_letters = max(map(len, keys), default=0) + KEY_SIGN_LETTERS
    key_columns = max(1, min(MOST_KEY_COLUMNS, int(KEY_LETTERS * width) // key_letters))

    note_inches = NOTE_LINE_INCHES * (text.count("\n") + 2)
    below = note_inches + KEY_LINE_INCHES * (-(-len(keys) // key_columns) + 0.5)
    title_inches = TITLE_LINE_INCHES * max(title.count("\n") + 1 for title in titles)
    panel_inches = ROW_LINE_INCHES * max(map(sum, sizes)) + title_inches + AXIS_INCHES
    height = down * panel_inches + below
    figure = new_figure(width, height, below / height)
    is_shared = all(own == labels[0] for own in labels)
    grid = figure.subplots(down, across, sharey=is_shared, squeeze=False).ravel()
    found = []
    for axes, title, own, size in zip(grid, titles, labels, sizes, strict=False):
        axes.set_title(title, loc="left").set_size(TITLE_POINTS * fitting / letters)
        _clear_axes(axes)
        found.append((axes, _label_rows(axes, own, size, headings)))
    for axes in grid[len(rows) :]:
        axes.set_visible(False)
    figure.legend(
        keys.values(), keys, loc="lower center", bbox_to_anchor=(0.5, note_inches / height),
        ncols=key_columns, columnspacing=1.2, handletextpad=0.7, borderaxespad=0, borderpad=0,
    )  # fmt: skip
    figure.text(0.01, 0.5 * NOTE_LINE_INCHES / height, text, fontsize=6, va="bottom")
    return figure, found


def _label_rows(
    axes: Axes, labels: Sequence[str], sizes: Sequence[int], headings: Collection[str]
) -> list[float]:
    """Label rows of some sizes from the top down; return their positions."""
    places = [sum(sizes[:number]) + size / 2 for number, size in enumerate(sizes)]
    axes.set_ylim(sum(sizes), 0)
    axes.set_yticks(places, labels)
    for label in axes.get_yticklabels():
        label.set_fontweight("bold" if label.get_text() in headings else "normal")
    return places
