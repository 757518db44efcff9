"""The paper's figures, drawn from the records of one or several runs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from roboirg.analysis.figures.figure_data import FigureData
from roboirg.analysis.figures.figure_style import save
from roboirg.core.errors import InvalidValueError, UnknownNameError

__all__ = ["FIGURES", "FigureData", "write_figures"]

FIGURES = ("averages", "forms", "expressions", "context", "failures")


def write_figures(
    content: FigureData, folder: Path, which: Sequence[str] = FIGURES, *, published: bool = False
) -> tuple[Path, ...]:
    """Draw figures as PNG, SVG and PDF; the expressions as PNG and SVG.

    Args:
        content: of the runs.
        folder: created if missing.
        which: names out of `FIGURES`; figures without data are left out.
        published: whether to add the paper's values, in gray.

    Returns:
        The files.

    Raises:
        UnknownNameError: a figure does not exist.
        MissingDependencyError: matplotlib is not installed.
        InvalidValueError: the folder is not writable, or there is nothing to draw.
    """
    for name in which:
        if name not in FIGURES:
            raise UnknownNameError("figure", name, FIGURES)
    paths = [
        path for name in which for path in _written(name, content, folder, published=published)
    ]
    if not paths:
        raise InvalidValueError(
            f"The runs have nothing to draw for {', '.join(which)}; `roboirg tables` shows what "
            "they have."
        )
    return tuple(paths)


def _written(name: str, content: FigureData, folder: Path, *, published: bool) -> tuple[Path, ...]:
    from roboirg.analysis.figures.averages import draw_averages
    from roboirg.analysis.figures.context import draw_context
    from roboirg.analysis.figures.expressions import write_expressions
    from roboirg.analysis.figures.failures import draw_failures
    from roboirg.analysis.figures.forms import draw_forms

    if name == "expressions":
        return write_expressions(content, folder, name)
    drawings = {
        "averages": partial(draw_averages, content, published=published),
        "context": partial(draw_context, content, published=published),
        "forms": partial(draw_forms, content),
        "failures": partial(draw_failures, content),
    }
    return save(drawings[name], folder, name)
