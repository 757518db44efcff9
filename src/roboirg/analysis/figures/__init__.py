"""The paper's figures, drawn from the records of one or several runs."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from roboirg.analysis.figures.failures import draw_failures
from roboirg.analysis.figures.figure_style import check_figure_support, save, style
from roboirg.analysis.figures.gaps import draw_next_to_reference
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.palette import palette
from roboirg.core.errors import InvalidValueError, check_names
from roboirg.util.discovery import with_entries

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class FigureKind(NamedTuple):
    """A figure of runs.

    Attributes:
        name: as in the command line.
        draw: returns the figure, None without data; it is called with the data of the runs, and
            with whether the paper's values are wanted, too.
    """

    name: str
    draw: Callable[[RunData, bool], Figure | None]


_OURS = (
    FigureKind("gaps", partial(draw_next_to_reference, "main")),
    FigureKind("context", partial(draw_next_to_reference, "context")),
    # The paper has no causes of failures.
    FigureKind("failures", lambda content, _published: draw_failures(content)),
)


@functools.cache
def figure_kinds() -> Mapping[str, FigureKind]:
    """Return ours and those of installed packages, by name."""
    return with_entries(_OURS, "FIGURE", FigureKind, "roboirg.figures")


def write_figures(
    content: RunData, folder: Path, which: Sequence[str], *, published: bool = False
) -> tuple[Path, ...]:
    """Draw figures as PNG, SVG and PDF, and as PNG and SVG for dark pages.

    Args:
        content: of the runs.
        folder: created if missing.
        which: names of figures; those without data are left out.
        published: whether to add the paper's values, in gray.

    Returns:
        The files.
    """
    paths: list[Path] = []
    shown = content.without_control_arms
    for name in which:
        paths += save(partial(figure_kinds()[name].draw, shown, published), folder, name)
    if not paths:
        whose = "The runs have" if content.cells else "The paper's tables have"
        raise InvalidValueError(
            f"{whose} nothing to draw for {', '.join(which)}; `roboirg tables` shows "
            "what they have."
        )
    return tuple(paths)


def draw_figure(name: str, content: RunData, *, published: bool = False) -> Figure | None:
    """Draw a figure; return None without data.

    Raises:
        UnknownNameError: there is no such figure.
    """
    check_names("figure", [name], figure_kinds())
    check_figure_support()
    import matplotlib as mpl

    with mpl.rc_context(style(palette().light)):
        return figure_kinds()[name].draw(content.without_control_arms, published)
