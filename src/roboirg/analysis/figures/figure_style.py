"""Style of all figures: sizes, colors, and file formats."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboirg.analysis.palette import Colors, palette
from roboirg.core.extras import extra_needed
from roboirg.util.atomic_write import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE_INCHES = 7.0
"""Width of a page; figures are drawn at final size."""
TITLE_POINTS = 9
"""Usual size of a panel's title."""
SMALL_POINTS = 7
"""Smallest letters: 11 pixels where a figure is as wide as a README."""
DOTS_PER_INCH = 300
_SETTINGS = {
    "font.family": "DejaVu Sans",
    "font.size": 8,
    "axes.linewidth": 0.6,
    "axes.titlesize": TITLE_POINTS,
    "axes.titleweight": "bold",
    "grid.linewidth": 0.5,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "pdf.fonttype": 42,  # letters, not outlines, which some venues refuse
    "svg.hashsalt": "roboirg",  # the ids in an SVG file are random without it
}
_SHEETS = ("figure.facecolor", "savefig.facecolor", "axes.facecolor")
_INKS = ("text.color", "axes.labelcolor", "axes.titlecolor", "xtick.color", "ytick.color")
_METADATA = {
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
    "png": None,
}


def style(colors: Colors) -> dict[Any, Any]:
    """Return matplotlib's settings for our figures in some colors of `palette`.

    A figure has a background of its own, so that it is legible on any page.
    """
    return {
        **_SETTINGS,
        **dict.fromkeys(_SHEETS, colors["sheet"]),
        **dict.fromkeys(_INKS, colors["ink"]),
        "axes.edgecolor": colors["edge"],
        "lines.color": colors["accent"],
        "grid.color": colors["line"],
    }


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
    """Draw a figure, and write it in several formats for light pages and for dark ones.

    Returns the files. Equal figures give equal files.

    Args:
        draw: makes the figure, anew for each style; None if there is nothing to draw.
        folder: created if missing.
        name: of the files, without an extension; those for dark pages have ``-dark`` behind it.
        formats: extensions; no PDF is written for dark pages.
    """
    check_figure_support()
    paths = _save_in_style(draw, folder, name, style(palette().light), formats)
    if paths:
        on_dark = [ending for ending in formats if ending != "pdf"]
        paths += _save_in_style(draw, folder, f"{name}-dark", style(palette().dark), on_dark)
    return tuple(paths)


def _save_in_style(
    draw: Callable[[], Figure | None],
    folder: Path,
    stem: str,
    settings: dict[Any, Any],
    formats: Sequence[str],
) -> list[Path]:
    """Draw a figure with some settings of matplotlib, write it, and return the files.

    Args:
        draw: makes the figure; None if there is nothing to draw.
        folder: of the files.
        stem: of their names.
        settings: of matplotlib, such as colors.
        formats: extensions, one file for each.
    """
    import matplotlib as mpl

    with mpl.rc_context(settings):
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
    """Lay out a figure, and round the places of its axes so that equal figures give equal files.

    The last digits of matplotlib's layout differ each time.
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


def ghost() -> str:
    """Return the color of what is published and of what only explains."""
    import matplotlib as mpl

    return str(mpl.rcParams["axes.edgecolor"])


def new_figure(width: float, height: float, below: float = 0) -> Figure:
    """Return an empty figure of the given size in inches, with a share of it left free below."""
    # Without pyplot, which keeps every figure and looks for a display.
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    engine = ConstrainedLayoutEngine(
        w_pad=0.08, h_pad=0.08, wspace=0.02, rect=(0, below, 1, 1 - below)
    )
    return Figure(figsize=(width, height), layout=engine)
