"""The sheet as a page to print: the blocks of trials, and the demonstrations."""

from __future__ import annotations

import itertools
import operator
from collections import Counter
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
    """Return the sheet as HTML: each block, and the demonstrations, begin on paper of their own.

    Trials are numbered over all blocks, in the order of the plan.
    """
    page = _HEAD
    number = 1
    for block, of_block in itertools.groupby(plan.trials, operator.attrgetter("block")):
        trials = list(of_block)
        title = f"Block {block}: {trials[0].job.task}"
        page += _section(plan, title, _block(trials, number))
        number += len(trials)
    if plan.demonstrations:
        demonstrations = [_demonstration(planned) for planned in plan.demonstrations]
        page += _section(plan, "Demonstrations", demonstrations)
    return page


def _section(plan: StudyPlan, title: str, content: Iterable[str]) -> str:
    """Return what is on paper of its own."""
    head = f"<h1>{title} <small>plan {plan.fingerprint}</small></h1>"
    return f"<section>{head}\n{''.join(content)}</section>\n"


def _block(trials: list[PlannedTrial], first_number: int) -> Iterator[str]:
    """Yield HTML: first what is to be arranged and meant in all trials of a block, then each trial.

    `first_number` is that of the first trial in the whole study.
    """
    first = trials[0]
    yield (
        f"{draw_svg(first.episode.scene)}\n"
        "<p>Arrange, measured from the center of the robot's base:</p>\n"
        f"{_listed(describe_positions(first.episode.scene))}"
        f"<p>Meaning of all instructions of this block: {escape(first.meaning)}</p>\n"
        "<p>Arrange the table again before each trial. Say the whole instruction as printed, then "
        "start.</p>\n"
    )
    for number, trial in enumerate(trials, first_number):
        boxes = [f"{BOX}&nbsp;{escape(word)} &nbsp;" for word in _verdicts(trial)]
        yield (
            f"<article><h2>{number}. {trial.name}</h2>\n"
            f"{_listed(trial.turns)}<p>{' '.join(boxes)}</p>\n"
            "<p>note ______________________________ video ____________</p></article>\n"
        )


def _verdicts(trial: PlannedTrial) -> list[str]:
    """Return the labels to tick; a failure that occurs several times names its object.

    Example: ``wrong_place:box_green`` becomes ``wrong place: box green``.
    """
    choices = failure_choices(trial.episode)
    counts = Counter(choice.failure for choice in choices)
    labels = ["success"]
    for choice in choices:
        label = choice.failure if counts[choice.failure] == 1 else choice.key
        labels.append(label.replace("_", " ").replace(":", ": "))
    labels.append("void")
    return labels


def _demonstration(planned: PlannedDemonstration) -> str:
    """Return what is to be arranged and said for a demonstration, and two boxes."""
    scene = planned.episode.scene
    return (
        f"<article><h2>{planned.name}</h2>\n{draw_svg(scene)}\n"
        f"{_listed(planned.turns)}{_listed(describe_positions(scene))}"
        f"<p>{BOX}&nbsp;recorded &nbsp; {BOX}&nbsp;discarded</p></article>\n"
    )


def _listed(lines: Iterable[str]) -> str:
    """Return lines of text as an HTML list, escaped."""
    items = [f"<li>{escape(line)}</li>" for line in lines]
    return f"<ul>{''.join(items)}</ul>\n"
