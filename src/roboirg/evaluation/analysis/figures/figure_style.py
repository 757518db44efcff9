"""Style of all figures: sizes, colors, signs, and file formats."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

from roboirg.core.errors import InvalidValueError
from roboirg.core.extras import extra_needed
from roboirg.evaluation.analysis.stats.intervals import Interval

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMN_INCHES, PAGE_INCHES = 3.4, 7.0
"""Widths of a column and of a page; figures are drawn at final size."""
LEGEND_LINE_INCHES = 0.16
LEGEND_LETTERS, MOST_COLUMNS, SIGN_LETTERS = 50, 2, 3
"""Letters of a legend's line in a figure of one column, its columns, and what a sign takes."""
TITLE_LETTERS = 34
"""Letters of a line above a panel."""
DOTS_PER_INCH = 300
STYLE = {
    "font.size": 7.5,
    "axes.linewidth": 0.6,
    "axes.edgecolor": "#999999",
    "axes.titlesize": 8.5,
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
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
"""Okabe and Ito's colors, safe for color-blind readers; signs differ as well."""
SIGNS = ("o", "s", "^", "D", "v", "P")
_METADATA: Mapping[str, Mapping[str, None] | None] = {
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
    "png": None,
}
_SAME_FILES: Mapping[str, object] = {
    "font.family": "DejaVu Sans",
    "pdf.fonttype": 42,  # letters, not outlines, which some venues refuse
    "svg.hashsalt": "roboirg",  # the ids in an SVG file are random without it
}
PUBLISHED_NOTE = "published: the same tasks, the paper's instructions and simulator"
GHOST, GHOST_SIGNS = "#8a8a8a", ("d", "X", "p", "<", ">", "h", "8", "*")


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
    on_dark = [one for one in formats if one != "pdf"]
    light = _save_in_style(draw, folder, name, formats, STYLE)
    return light + _save_in_style(draw, folder, f"{name}-dark", on_dark, DARK_STYLE)


def _save_in_style(
    draw: Callable[[], Figure | None],
    folder: Path,
    name: str,
    formats: Sequence[str],
    style: Mapping[str, object],
) -> tuple[Path, ...]:
    check_figure_support()
    import matplotlib as mpl

    with mpl.rc_context(cast("Any", {**_SAME_FILES, **style})):
        figure = draw()
        if figure is None:
            return ()
        paths = tuple(folder / f"{name}.{one}" for one in formats)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for path, one in zip(paths, formats, strict=True):
                figure.savefig(path, dpi=DOTS_PER_INCH, metadata=_METADATA[one])
        except OSError as error:
            raise InvalidValueError(f"Cannot write to {folder}: {error.strerror}.") from error
    return paths


def paper() -> str:
    """Return the color of the page that is being drawn."""
    return _drawn_with("axes.facecolor")


def first_color() -> str:
    """Return the first of the colors, which is a lighter blue on dark pages."""
    return _drawn_with("lines.color")


def _drawn_with(name: Literal["axes.facecolor", "lines.color"]) -> str:
    import matplotlib as mpl

    return str(mpl.rcParams[name])


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of the given size in inches."""
    # Without pyplot, which keeps every figure and looks for a display.
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    return Figure(
        figsize=(width, height), layout=ConstrainedLayoutEngine(w_pad=0.03, h_pad=0.03, wspace=0.04)
    )


def clear_axes(axes: Axes, *, grid: str) -> None:
    """Remove most of the frame and add grid lines for one axis."""
    axes.set_axisbelow(True)
    axes.grid(axis="x" if grid == "x" else "y")
    axes.tick_params(axis="both", length=0)
    for side in ("top", "right", "left" if grid == "x" else "bottom"):
        axes.spines[side].set_visible(False)


def folded(name: str, letters: int) -> str:
    """Return a name in lines of at most `letters` letters."""
    return textwrap.fill(name, letters, break_on_hyphens=False)


def rates_figure(height: float, labels: Sequence[str]) -> tuple[Figure, Axes]:
    """Return an empty one-column figure for success in percent, with room for a legend below.

    The height is in inches, without the legend.
    """
    lines = sum(folded(one, LEGEND_LETTERS).count("\n") + 1 for one in labels)
    lines = -(-lines // _legend_columns(labels))
    figure = new_figure(COLUMN_INCHES, height + LEGEND_LINE_INCHES * lines)
    axes = figure.subplots()
    clear_axes(axes, grid="y")
    axes.set_ylim(-3, 103)
    axes.set_yticks(range(0, 101, 25))
    axes.set_ylabel("success, %")
    return figure, axes


def draw_point(
    axes: Axes, place: float, rate: float, interval: Interval | None, number: int, label: str
) -> None:
    """Draw a rate with its interval, both from 0 to 1."""
    color = COLORS[number % len(COLORS)]
    if interval is not None:
        axes.plot([place] * 2, [100 * end for end in interval], color=color, linewidth=1.1)
    axes.plot(
        [place],
        [100 * rate],
        linestyle="none",
        marker=SIGNS[number % len(SIGNS)],
        markersize=4.6,
        color=color,
        label=label,
    )


def draw_ghost(axes: Axes, place: float, percent: float, number: int, label: str) -> None:
    """Draw a published value."""
    axes.plot(
        [place],
        [percent],
        linestyle="none",
        marker=GHOST_SIGNS[number % len(GHOST_SIGNS)],
        markersize=4.2,
        markerfacecolor="none",
        markeredgecolor=GHOST,
        markeredgewidth=0.8,
        label=label,
        zorder=1,
    )


def legend_below(figure: Figure, axes: Axes) -> None:
    """Add a legend below the axes with every label once."""
    handles, names = axes.get_legend_handles_labels()
    found = dict(zip(names, handles, strict=True))
    labels = [folded(name, LEGEND_LETTERS) for name in found]
    figure.legend(
        found.values(), labels, loc="outside lower center", ncols=_legend_columns(labels),
        columnspacing=1.2, handletextpad=0.3,
    )  # fmt: skip


def _legend_columns(labels: Sequence[str]) -> int:
    """Return in how many columns the labels fit next to each other."""
    longest = max(map(len, labels), default=0) + SIGN_LETTERS
    return max(1, min(MOST_COLUMNS, LEGEND_LETTERS // longest))
