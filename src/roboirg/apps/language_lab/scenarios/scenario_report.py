"""A checked scenario in lines of text, for their author."""

from __future__ import annotations

from collections.abc import Iterator

from roboirg.apps.language_lab.scenarios.explicit_check import ExplicitReport
from roboirg.apps.language_lab.scenarios.scenario_check import ScenarioReport
from roboirg.core.plain_text import counted
from roboirg.language.token_counts import USUAL_LIMIT, tokens_shown


def explicit_lines(report: ExplicitReport, task: str) -> Iterator[str]:
    """Yield what an author wants to know of the explicit words of a task."""
    yield f"explicit ({task})"
    yield from (f"  {text}" for text in report.renderings)
    tokens = tokens_shown(report.longest)
    yield f"  {tokens} of {USUAL_LIMIT} tokens; states {counted(report.goals, 'goal')}."
    if report.unstated:
        yield (
            f"  No sentence of {counted(len(report.unstated), 'goal')}, such as "
            f"{next(iter(report.unstated))}; episodes with them cannot be played in explicit."
        )
    yield from (f"  BROKEN {rule}" for rule in report.broken)
    yield ""


def report_lines(report: ScenarioReport, task: str) -> Iterator[str]:
    """Yield what an author wants to know of a scenario in a task: texts, length, broken rules."""
    fields, fits = report.scenario.fields, report.scenes
    yield f"{fields.frame} ({task}, {fields.setting}, {fields.pool or 'both pools'})"
    yield from (f"  {text}" for text in report.renderings)
    if report.competing:
        yield f"  With a competing remark: {report.competing}"
    tokens = tokens_shown(report.longest)
    yield f"  {tokens} of {USUAL_LIMIT} tokens; fits {counted(fits, 'scene')}."
    if report.open < fits:
        yield (
            f"  In {counted(fits - report.open, 'scene')} the command alone gives the goal, "
            "because the scene leaves only one; this is counted, not broken."
        )
    for rule, number in report.broken.items():
        example = report.examples[rule]
        often = f" (in {counted(number, 'scene')})" if example else ""
        yield f"  BROKEN {rule}{often}"
        if example and example not in report.renderings:
            mark = "resolved: " if example in report.resolved else ""
            yield f"    {mark}{example}"
    yield ""
