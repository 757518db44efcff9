"""The sheet as a page to print: the blocks of trials, and the demonstrations."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from html import escape

from roboirg.apps.real.pages.arrangement_svg import draw_svg
from roboirg.apps.real.study.arrangement_shapes import describe_positions
from roboirg.apps.real.study.failure_choices import failure_choices
from roboirg.apps.real.study.study_plan import PlannedDemonstration, PlannedTrial, StudyPlan

SHEET_FILE = "sheet.html"
BOX = "☐"
_HEAD = """\
<!doctype html>
<html lang="en">
<meta charset="utf-8">
<title>Trials</title>
<style>
@page { size: A4; margin: 12mm; }
body { font: 9pt/1.35 sans-serif; }
section { break-before: page; }
section:first-of-type { break-before: auto; }
article { break-inside: avoid; clear: both; border-top: 1px solid #bbbbbb; }
h1 { font-size: 13pt; }
h1 small { float: right; font-size: 7.5pt; font-weight: normal; }
h2 { font-size: 9pt; }
h2, p, ul { margin: 1mm 0; }
ul { overflow: hidden; padding-left: 5mm; }
svg { float: left; height: 60mm; margin-right: 6mm; }
</style>
"""


def sheet_text(plan: StudyPlan) -> str:
    """Return the page: each block and the demonstrations begin on paper of their own."""
    numbers = itertools.count(1)
    blocks = [
        (f"Block {block}: {task}", _block([*trials], numbers))
        for (block, task), trials in itertools.groupby(
            plan.trials, key=lambda trial: (trial.block, trial.job.task)
        )
    ]
    if plan.demonstrations:
        blocks.append(("Demonstrations", map(_demonstration, plan.demonstrations)))
    sections = (
        f"<section><h1>{title} <small>plan {plan.fingerprint}</small></h1>\n"
        f"{''.join(content)}</section>\n"
        for title, content in blocks
    )
    return _HEAD + "".join(sections)


def _block(trials: list[PlannedTrial], numbers: Iterator[int]) -> Iterator[str]:
    """Yield what is to be arranged and meant in all trials of a block, and each trial."""
    first = trials[0]
    yield (
        f"{draw_svg(first.episode.scene)}\n"
        "<p>Arrange, measured from the center of the robot's base:</p>\n"
        f"{_listed(describe_positions(first.episode.scene))}"
        f"<p>Meaning of all instructions of this block: {escape(first.meaning)}</p>\n"
        "<p>Arrange the table again before each trial. Say the whole instruction as printed, then "
        "start.</p>\n"
    )
    for trial in trials:
        boxes = " ".join(f"{BOX}&nbsp;{escape(word)} &nbsp;" for word in _verdicts(trial))
        yield (
            f"<article><h2>{next(numbers)}. {trial.name}</h2>\n"
            f"{_listed(trial.turns)}<p>{boxes}</p>\n"
            "<p>note ______________________________ video ____________</p></article>\n"
        )


def _verdicts(trial: PlannedTrial) -> list[str]:
    """Return the labels to tick; a failure that occurs several times names its object."""
    choices = failure_choices(trial.episode)
    names = [one.failure for one in choices]
    labels = [one.failure if names.count(one.failure) == 1 else one.key for one in choices]
    return ["success", *(word.replace("_", " ").replace(":", ": ") for word in labels), "void"]


def _demonstration(one: PlannedDemonstration) -> str:
    return (
        f"<article><h2>{one.name}</h2>\n{draw_svg(one.episode.scene)}\n"
        f"{_listed(one.turns)}{_listed(describe_positions(one.episode.scene))}"
        f"<p>{BOX}&nbsp;recorded &nbsp; {BOX}&nbsp;discarded</p></article>\n"
    )


def _listed(lines: Iterable[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>\n"
