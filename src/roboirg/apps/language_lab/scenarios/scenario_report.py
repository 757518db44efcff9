"""A checked scenario in lines of text, for their author."""

from __future__ import annotations

from collections.abc import Iterator

from roboirg.apps.language_lab.scenarios.explicit_check import ExplicitReport
from roboirg.apps.language_lab.scenarios.scenario_check import ScenarioReport
from roboirg.core.plain_text import counted
from roboirg.language.token_counts import USUAL_LIMIT, tokens_shown

_MOST_GOALS = 10
"""Goals without a sentence that are listed."""


def explicit_lines(report: ExplicitReport, task: str) -> Iterator[str]:
    """Yield the lines of a report on a file's explicit words for a task.

    They have a few texts, the length of the longest, goals without a sentence, and what is wrong.
    """
    yield f"explicit ({task})"
    for text in report.renderings:
        yield f"  {text}"
    tokens = tokens_shown(report.longest)
    yield f"  {tokens} of {USUAL_LIMIT} tokens; states {counted(len(report.stated), 'goal')}."
    for goal in report.unused:
        yield f"  No scene has the goal of a sentence: {goal}"
    if report.unstated:
        goals = "; ".join(list(report.unstated)[:_MOST_GOALS])
        yield (
            f"  No sentence of {counted(len(report.unstated), 'goal')}, such as: {goals}. Episodes "
            "with them cannot be played in explicit."
        )
    for rule in report.broken:
        yield f"  BROKEN {rule}"
    yield ""


def report_lines(report: ScenarioReport, task: str) -> Iterator[str]:
    """Yield the lines of a report on a scenario, a text template, in a task.

    They have a few texts, the length of the longest, the number of scenes, and the broken rules.
    """
    fields = report.scenario.fields
    yield f"{fields.frame} ({task}, {fields.setting}, {fields.pool or 'both pools'})"
    for text in report.renderings:
        yield f"  {text}"
    if report.competing:
        yield f"  With a competing remark: {report.competing}"
    tokens = tokens_shown(report.longest)
    scenes = len(report.fitting)
    yield f"  {tokens} of {USUAL_LIMIT} tokens; fits {counted(scenes, 'scene')}."
    if report.open < scenes:
        yield (
            f"  In {counted(scenes - report.open, 'scene')} the command alone gives the "
            "goal, because the scene leaves only one; this is counted, not broken."
        )
    for rule in report.broken:
        yield from _rule_lines(report, rule)
    yield ""


def _rule_lines(report: ScenarioReport, rule: str) -> Iterator[str]:
    """Yield the lines on a broken rule: how often it is broken, and a text that breaks it.

    A rule that the sentences break as they are written, whatever the scene, has neither.
    """
    example = report.examples[rule]
    if not example:
        yield f"  BROKEN {rule}"
        return
    yield f"  BROKEN {rule} (in {counted(report.broken[rule], 'scene')})"
    mark = "resolved: " if example in report.resolved else ""
    yield f"    {mark}{example}"
