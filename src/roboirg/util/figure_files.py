"""Figures drawn by matplotlib, as files that are the same for the same content."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from roboirg.core.errors import InvalidValueError
from roboirg.core.extras import extra_needed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_METADATA: Mapping[str, Mapping[str, None] | None] = {
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
    "png": None,
}
_STYLE: Mapping[str, object] = {
    "font.family": "DejaVu Sans",
    "pdf.fonttype": 42,  # letters, not outlines, which some venues refuse
    "svg.hashsalt": "roboirg",  # the ids in an SVG file are random without it
}


def check_figure_support() -> None:
    """Check early that figures can be drawn."""
    with extra_needed("Figures need matplotlib", "report"):
        import matplotlib as mpl  # noqa: F401


def save_figure(
    draw: Callable[[], Figure | None],
    folder: Path,
    name: str,
    *,
    formats: Sequence[str],
    dots_per_inch: int,
    style: Mapping[str, object],
) -> tuple[Path, ...]:
    """Draw a figure and write it in all formats; write no file without a figure.

    Args:
        draw: draws it; returns None if there is nothing to show.
        folder: created if it is missing.
        name: of the files, without extension.
        formats: extensions, of ``png``, ``svg`` and ``pdf``.
        dots_per_inch: of pixel formats.
        style: matplotlib's settings, besides fonts and reproducible ids.

    Returns:
        The files.
    """
    check_figure_support()
    import matplotlib as mpl

    with mpl.rc_context(cast("Any", {**_STYLE, **style})):
        figure = draw()
        if figure is None:
            return ()
        paths = tuple(folder / f"{name}.{one}" for one in formats)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for path, one in zip(paths, formats, strict=True):
                figure.savefig(path, dpi=dots_per_inch, metadata=_METADATA[one])
        except OSError as error:
            raise InvalidValueError(f"Cannot write to {folder}: {error.strerror}.") from error
    return paths
