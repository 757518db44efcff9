"""Figure: causes of failures, by policy and setting."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from typing import TYPE_CHECKING

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.figures.figure_style import (
    COLUMN_INCHES,
    LEGEND_LINE_INCHES,
    PAGE_INCHES,
    TITLE_LETTERS,
    clear_axes,
    folded,
    new_figure,
    paper,
)
from roboirg.evaluation.analysis.stats.cells import PolicyRun
from roboirg.evaluation.analysis.stats.failure_counts import FAILURES, count_failures
from roboirg.evaluation.analysis.stats.option_labels import options_label, options_sort_key
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.judging.failure_attribution import EXECUTION, GROUNDING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROW_INCHES, MARGIN_INCHES = 0.2, 0.55
_ORANGE = ("#7f2704", "#a63603", "#c0510a", "#ee8130", "#fbb477", "#fddfbf", "#fff1e3")
_BLUE = ("#08306b", "#20578f", "#3f85bd", "#74b0d8", "#a9d0e8", "#d9ebf6")
COLORS = dict(zip(FAILURES, (*_ORANGE, *_BLUE, "#bbbbbb"), strict=True))
"""Shades of orange for grounding, of blue for execution."""
MAX_COLUMNS = 2
LEGEND_COLUMNS = {1: 2, 2: 4}
MIN_LABELED_PERCENT = 6.0
"""Smallest part with room for its number, percent."""
_DARK = frozenset((*GROUNDING[:3], *EXECUTION[:3]))

Counts = Mapping[tuple[PolicyRun, InstructionOptions], Counter[str]]


def draw_failures(content: RunData) -> Figure | None:
    """Draw the shares of episodes by cause of failure; return None without failures."""
    counts, played = _counts(content)
    if not any(counts.values()):
        return None
    names = [one for one in content.names if any(own == one for own, _ in played)]
    bars = sorted({options for _, options in played}, key=options_sort_key)
    across = min(MAX_COLUMNS, len(names))
    down = -(-len(names) // across)
    kinds = [kind for kind in COLORS if any(own[kind] for own in counts.values())]
    columns = LEGEND_COLUMNS[across]
    figure = new_figure(
        PAGE_INCHES if across > 1 else COLUMN_INCHES,
        down * (ROW_INCHES * len(bars) + MARGIN_INCHES)
        + LEGEND_LINE_INCHES * (-(-len(kinds) // columns) + 1),
    )
    axes = figure.subplots(down, across, squeeze=False, sharey=True).ravel()
    for panel, policy_run in zip(axes, names, strict=False):
        for place, options in enumerate(bars):
            key = (policy_run, options)
            _draw_bar(panel, place, counts.get(key), played[key])
        title = folded(content.name(policy_run), TITLE_LETTERS)
        panel.set_title(title, loc="left")
        panel.set_xlabel("share of the episodes with a verdict, %")
        panel.set_xlim(0, 100)
        panel.set_xticks(range(0, 101, 25))
        clear_axes(panel, grid="x")
    for panel in axes[len(names) :]:
        panel.set_visible(False)
    axes[0].set_yticks(range(len(bars)), [options_label(options) for options in bars])
    axes[0].set_ylim(len(bars) - 0.5, -0.5)
    _add_legend(figure, kinds, columns)
    return figure


def _counts(content: RunData) -> tuple[Counts, Counter[tuple[PolicyRun, InstructionOptions]]]:
    counts: dict[tuple[PolicyRun, InstructionOptions], Counter[str]] = defaultdict(Counter)
    played: Counter[tuple[PolicyRun, InstructionOptions]] = Counter()
    for key, cell in content.cells.items():
        played[key.policy_run, key.options] += cell.trials
    for key, own in count_failures(content).items():
        counts[key.policy_run, key.options] += own
    return counts, played


def _draw_bar(axes: Axes, place: int, counts: Counter[str] | None, played: int) -> None:
    if not played:
        axes.text(1, place, "–", va="center", fontsize=7, color="#777777")
        return
    if not counts:
        axes.text(1, place, "none", va="center", fontsize=6.5, color="#777777")
    left = 0.0
    for kind, color in COLORS.items():
        count = (counts or Counter())[kind]
        if not count:
            continue
        width = 100 * count / played
        axes.barh(
            place, width, left=left, height=0.78, color=color, edgecolor=paper(), linewidth=0.5
        )
        if width >= MIN_LABELED_PERCENT:
            axes.text(
                left + width / 2, place, str(count), ha="center", va="center", fontsize=6.5,
                color="white" if kind in _DARK else "black",
            )  # fmt: skip
        left += width


def _add_legend(figure: Figure, kinds: list[str], columns: int) -> None:
    from matplotlib.patches import Patch

    def words(kind: str) -> str:
        group = "grounding: " if kind in GROUNDING else "execution: " if kind in EXECUTION else ""
        return group + kind.replace("_", " ")

    figure.legend(
        [Patch(facecolor=COLORS[kind], edgecolor=paper()) for kind in kinds],
        [words(kind) for kind in kinds],
        loc="outside lower center", ncols=columns, columnspacing=1.0, handletextpad=0.4,
    )  # fmt: skip
