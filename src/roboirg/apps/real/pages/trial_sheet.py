"""Draw the printable sheet: one block of trials or six demonstrations per page."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from roboirg.apps.real.study.arrangement_shapes import (
    FARTHEST,
    HALF_WIDTH,
    INK,
    NEAREST,
    Shape,
    scene_shapes,
    square_corners,
)
from roboirg.apps.real.study.failure_choices import failure_choices
from roboirg.apps.real.study.study_plan import PlannedDemonstration, PlannedTrial, StudyPlan
from roboirg.apps.real.study.trial_text import describe_positions, explicit_command, spoken_turns
from roboirg.core.extras import extra_needed
from roboirg.util.atomic_write import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHEET_FILE = "sheet.pdf"
PAGE_INCHES = (8.27, 11.69)
"""A4."""
SIDE, TOP = 0.06, 0.955
"""Margins, as shares of the page."""
LINE = 0.0135
"""Height of a line of text, as a share of the page."""
COLUMNS = 100
"""Characters per line in the text size of trials."""
SMALL, PLAIN, LARGE = 7.5, 8.5, 13.0
"""Points."""
BOX = "☐"
LOWEST = 0.05
"""Lower end of the text, as a share of the page."""
DEMONSTRATIONS_PER_PAGE = 6


def write_sheet(plan: StudyPlan, path: Path) -> int:
    """Draw the sheet as PDF; returns its number of pages."""
    with extra_needed("The sheet needs matplotlib", "report"):
        from matplotlib.backends.backend_pdf import PdfPages

    # Without the date, so that the same plan gives the same file.
    metadata = {"CreationDate": None, "Title": "Trials"}
    with replacing(path) as partial, PdfPages(partial, metadata=metadata) as pages:
        for number, page in enumerate(_pages(plan), 1):
            page.text(0.5, 0.02, f"plan {plan.fingerprint}, page {number}", fontsize=SMALL,
                      ha="center", color="#666666")  # fmt: skip
            pages.savefig(page)
        return int(pages.get_pagecount())


def _pages(plan: StudyPlan) -> Iterator[Figure]:
    positions = {trial.name: number for number, trial in enumerate(plan.trials, 1)}
    for block, trials in groupby(plan.trials, key=lambda trial: trial.block):
        yield from _block_pages(block, list(trials), positions)
    numbered = list(enumerate(plan.demonstrations, 1))
    for start in range(0, len(numbered), DEMONSTRATIONS_PER_PAGE):
        yield _demonstration_page(numbered[start : start + DEMONSTRATIONS_PER_PAGE])


def _page() -> Figure:
    from matplotlib.figure import Figure

    return Figure(figsize=PAGE_INCHES)


def _block_pages(
    block: int, trials: Sequence[PlannedTrial], positions: dict[str, int]
) -> Iterator[Figure]:
    page = _page()
    first = trials[0]
    page.text(SIDE, TOP, f"Block {block}: {first.job.task}", fontsize=LARGE, weight="bold")
    draw_arrangement(page.add_axes((SIDE, 0.735, 0.38, 0.205)), scene_shapes(first.episode.scene))
    facts = (
        "Arrange, measured from the center of the robot's base:",
        *(f"   {line}" for line in describe_positions(first)),
        "",
        "Meaning of all instructions of this block:",
        *(f"   {line}" for line in textwrap.wrap(explicit_command(first), 48)),
        "",
        "Arrange the table again before each trial. Say the",
        "whole instruction as printed, then start.",
    )
    for number, line in enumerate(facts):
        page.text(0.48, TOP - 0.03 - number * 1.15 * LINE, line, fontsize=PLAIN)
    y = 0.705
    for trial in trials:
        lines = _trial_lines(trial)
        height = (len(lines) + 2.3) * LINE
        if y - height < LOWEST:
            yield page
            page, y = _page(), TOP
            page.text(SIDE, y, f"Block {block}, continued", fontsize=LARGE, weight="bold")
            y -= 2 * LINE
        _draw_trial(page, y, f"{positions[trial.name]}.  {trial.name}", lines, trial)
        y -= height
    yield page


def _trial_lines(trial: PlannedTrial) -> list[str]:
    return [
        line
        for turn in spoken_turns(trial)
        for line in textwrap.wrap(f"“{turn}”", COLUMNS, subsequent_indent="  ")
    ]


def _draw_trial(
    page: Figure, y: float, title: str, lines: Sequence[str], trial: PlannedTrial
) -> None:
    from matplotlib.lines import Line2D

    page.add_artist(Line2D([SIDE, 1 - SIDE], [y + 0.8 * LINE] * 2, color="#bbbbbb", linewidth=0.5))
    page.text(SIDE, y - 0.2 * LINE, title, fontsize=SMALL, weight="bold")
    page.text(1 - SIDE, y - 0.2 * LINE, "note ______________________  video ____________",
              fontsize=SMALL, ha="right")  # fmt: skip
    for number, line in enumerate(lines, 1):
        page.text(SIDE + 0.01, y - (number + 0.15) * LINE, line, fontsize=PLAIN)
    ticks = "   ".join(f"{BOX} {word}" for word in _verdicts(trial))
    page.text(SIDE + 0.01, y - (len(lines) + 1.15) * LINE, ticks, fontsize=SMALL,
              family="DejaVu Sans")  # fmt: skip


def _verdicts(trial: PlannedTrial) -> list[str]:
    """Return the labels to tick; a failure that occurs several times names its object."""
    choices = failure_choices(trial.episode)
    names = [one.failure for one in choices]
    labels = [one.failure if names.count(one.failure) == 1 else one.key for one in choices]
    return ["success", *(word.replace("_", " ").replace(":", ": ") for word in labels), "void"]


def _demonstration_page(planned: Sequence[tuple[int, PlannedDemonstration]]) -> Figure:
    page = _page()
    page.text(SIDE, TOP, "Demonstrations", fontsize=LARGE, weight="bold")
    for index, (number, one) in enumerate(planned):
        left, bottom = SIDE + 0.46 * (index % 2), 0.70 - 0.305 * (index // 2)
        draw_arrangement(page.add_axes((left, bottom + 0.04, 0.42, 0.165)), scene_shapes(
            one.episode.scene))  # fmt: skip
        page.text(left, bottom + 0.218, f"{number}.  {one.name}", fontsize=PLAIN, weight="bold")
        instruction = textwrap.wrap(" ".join(f"“{turn}”" for turn in spoken_turns(one)), 52)
        lines = (*instruction, *describe_positions(one), f"{BOX} recorded   {BOX} discarded")
        for row, line in enumerate(lines):
            page.text(left, bottom + 0.011 - row * 0.9 * LINE, line, fontsize=SMALL)
    return page


def draw_arrangement(axes: Axes, shapes: Sequence[Shape]) -> None:
    """Draw the table from above, the robot at the bottom, so its left is on the left."""
    from matplotlib.patches import Circle, Polygon

    axes.set_xlim(HALF_WIDTH, -HALF_WIDTH)
    axes.set_ylim(NEAREST, FARTHEST)
    axes.set_aspect("equal", adjustable="box")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_xlabel("left          ▲ robot          right", fontsize=PLAIN)
    for shape in shapes:
        if shape.form == "square":
            for half, shade in ((shape.half, 1.0), (shape.hole, 0.25)):
                points = [(y, x) for x, y in square_corners(shape, half)]
                axes.add_patch(Polygon(points, facecolor="white"))
                axes.add_patch(
                    Polygon(points, facecolor=(shape.fill, shade), edgecolor=INK, linewidth=0.7)
                )
        else:
            for radius, fill in ((shape.half, shape.fill), (shape.hole, "white")):
                patch = Circle((shape.y, shape.x), radius, facecolor=fill, edgecolor=INK)
                patch.set_linewidth(0.7 if radius else 0.0)
                axes.add_patch(patch)
        axes.annotate(shape.label, (shape.y, shape.x - 1.3 * shape.half), ha="center", va="top",
                      fontsize=SMALL)  # fmt: skip
