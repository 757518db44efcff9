"""Figure: a failure in pictures, the explicit play above and the implicit one below it."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from roboirg.core.extras import extra_needed
from roboirg.evaluation.analysis.figures.figure_style import GHOST, PAGE_INCHES, new_figure
from roboirg.evaluation.analysis.results.option_labels import (
    REFERENCE,
    options_label,
    options_sort_key,
)
from roboirg.evaluation.plan.sources import Source
from roboirg.evaluation.records.film import FRAME_STEPS, LAST_FRAME_REPEATS
from roboirg.evaluation.records.record import Record, Summary
from roboirg.evaluation.records.run_files import run_file
from roboirg.util.media import CONTROL_RATE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PICTURES = 5
MOMENT_COLOR = "#D62728"
ROW_INCHES = 1.9
PICTURE_PIXELS = 256
_SUBGOAL_LETTERS, _TITLE_LETTERS = 26, 118


def draw_strips(sources: Sequence[Source]) -> Figure | None:
    """Draw for each policy the first failure that was filmed, below its explicit play.

    Returns:
        None without a failed implicit episode whose explicit twin was filmed as well.
    """
    strips = [(source, record) for source in sources for record in _shown_records(source)]
    if not strips:
        return None
    figure = new_figure(PAGE_INCHES, ROW_INCHES * len(strips))
    rows = figure.subfigures(len(strips), 1, squeeze=False).ravel()
    for row, (source, record) in zip(rows, strips, strict=True):
        words = " ".join(turn.text for turn in record.instruction)
        title = f"{record.policy}, {options_label(record.column)}: “{words}”"
        if record.cause:
            title += f" {record.cause[0].upper()}{record.cause[1:]}."
        row.suptitle(textwrap.fill(title, _TITLE_LETTERS), fontsize=7, x=0.01, ha="left")
        steps = shown_steps(record)
        pictures = _pictures(run_file(source.folder, record.video or ""), record, steps)
        for axes, step, picture in zip(row.subplots(1, PICTURES), steps, pictures, strict=True):
            axes.imshow(picture)
            _label_picture(axes, record, step)
    return figure


def shown_steps(record: Record) -> list[int]:
    """Return the control steps that are shown, in order; of a failure its moment among them."""
    steps = [round(record.steps * place / (PICTURES - 1)) for place in range(PICTURES)]
    if (moment := _moment(record)) is not None:
        nearest = min(range(PICTURES), key=lambda place: abs(steps[place] - moment))
        steps[nearest] = moment
    return steps


def _moment(record: Record) -> int | None:
    """Return the control step at which a failure showed, or the last; None without a failure."""
    if record.outcome != "failure":
        return None
    found = None if record.attribution is None else record.attribution.step
    return record.steps if found is None else found


def _shown_records(source: Source) -> list[Record]:
    """Return the records of a run that are shown, the explicit one before each failure."""
    filmed = [one for one in source.results if one.video is not None]
    results = [one for one in filmed if one.robot is None]  # other films have times of their own
    explicit = {_scene(one): one for one in results if one.column == REFERENCE}
    chosen: dict[str, Summary] = {}
    for one in sorted(results, key=lambda one: (*_scene(one), options_sort_key(one.options))):
        if one.outcome == "failure" and one.column != REFERENCE and _scene(one) in explicit:
            chosen.setdefault(one.policy, one)
    wanted = [job.identity for one in chosen.values() for job in (explicit[_scene(one)], one)]
    found = {one.identity: one for one in source.records() if one.identity in wanted}
    return [found[job] for job in wanted]


def _scene(result: Summary) -> tuple[object, ...]:
    return result.policy, result.task, result.split, result.episode, result.policy_seed


def _label_picture(axes: Axes, record: Record, step: int) -> None:
    """Write below a picture its time and the subgoal that held; frame the moment of a failure."""
    is_moment = step == _moment(record)
    axes.set(xticks=[], yticks=[])
    for spine in axes.spines.values():
        spine.set(color=MOMENT_COLOR if is_moment else GHOST, linewidth=2.5 * is_moment + 0.5)
    text = f"{step / CONTROL_RATE:.1f} s"
    if subgoals := [one.text for one in record.subgoals if one.step <= step]:
        text += "\n" + textwrap.fill(f"“{subgoals[-1]}”", _SUBGOAL_LETTERS)
    label = axes.set_xlabel(text, fontsize=6)
    if is_moment:
        label.set_color(MOMENT_COLOR)


def _pictures(path: Path, record: Record, steps: Sequence[int]) -> list[NDArray[np.uint8]]:
    """Return the front camera's pictures at some control steps of a film."""
    with extra_needed("Strips need PyAV", "sim"):
        import av
    with av.open(str(path)) as film:
        frames = [
            frame.to_ndarray(format="rgb24").astype(np.uint8) for frame in film.decode(video=0)
        ]
    last = len(frames) - 1 - LAST_FRAME_REPEATS
    places = (round(last - (record.steps - step) / FRAME_STEPS) for step in steps)
    shown = (frames[min(max(place, 0), len(frames) - 1)] for place in places)
    return [frame[:PICTURE_PIXELS, :PICTURE_PIXELS] for frame in shown]
