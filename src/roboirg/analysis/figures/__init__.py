"""The paper's figures, drawn from the records of one or several runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from roboirg.analysis.figures.failures import draw_failures
from roboirg.analysis.figures.figure_style import STYLE, check_figure_support, save
from roboirg.analysis.figures.gaps import draw_next_to_reference
from roboirg.analysis.measures.run_data import RunData
from roboirg.core.errors import InvalidValueError, check_names

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES: Mapping[str, Callable[[RunData, bool], Figure | None]] = {
    "gaps": partial(draw_next_to_reference, "main"),
    "context": partial(draw_next_to_reference, "context"),
    # The paper has no causes of failures.
    "failures": lambda content, _published: draw_failures(content),
}
"""By name: what draws a figure of runs, and of the paper's values if wanted; None without data."""


def write_figures(
    content: RunData, folder: Path, which: Sequence[str] = (*FIGURES,), *, published: bool = False
) -> tuple[Path, ...]:
    """Draw figures as PNG, SVG and PDF, and as PNG and SVG for dark pages.

    Args:
        content: of the runs.
        folder: created if missing.
        which: names out of `FIGURES`; figures without data are left out.
        published: whether to add the paper's values, in gray.

    Returns:
        The files.
    """
    paths: list[Path] = []
    for name in which:
        paths += save(partial(FIGURES[name], content.told, published), folder, name)
    if not paths:
        whose = "The runs have" if content.cells else "The paper's tables have"
        raise InvalidValueError(
            f"{whose} nothing to draw for {', '.join(which)}; `roboirg tables` shows "
            "what they have."
        )
    return tuple(paths)


def draw_figure(name: str, content: RunData, *, published: bool = False) -> Figure | None:
    """Draw one of `FIGURES`; return None without data.

    Raises:
        UnknownNameError: there is no such figure.
    """
    check_names("figure", [name], FIGURES)
    check_figure_support()
    import matplotlib as mpl

    # The keys of its own type are those of one version.
    with mpl.rc_context(cast("Any", STYLE)):
        return FIGURES[name](content.told, published)
