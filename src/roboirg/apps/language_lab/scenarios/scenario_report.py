"""A checked scenario in lines of text, for its author."""

from __future__ import annotations

from collections.abc import Iterator

from roboirg.apps.language_lab.scenarios.scenario_check import ScenarioReport
from roboirg.core.plain_text import counted
from roboirg.language.token_counts import USUAL_LIMIT


def report_lines(report: ScenarioReport) -> Iterator[str]:
    """Yield what an author wants to know: texts, length, scenes, and every broken rule."""
    fields = report.scenario.fields
    yield f"{fields.frame} ({fields.setting}, {fields.pool})"
    for text in report.renderings:
        yield f"  {text}"
    yield (
        f"  {report.tokens} of {USUAL_LIMIT} tokens; fits {counted(report.scenes, 'scene')}; "
        f"the interpreter does not read {report.refused} of {counted(report.read, 'text')}."
    )
    if report.misread:
        yield f"  It gets another goal from {len(report.misread)}; if you do not, tell its authors:"
        yield f"    {report.misread[0]}"
    if report.open < report.scenes:
        closed = report.scenes - report.open
        yield f"  In {counted(closed, 'scene')} the command alone gives the goal."
    for rule, number in report.broken.items():
        often = f" (in {counted(number, 'scene')})" if report.examples[rule] else ""
        yield f"  BROKEN {rule}{often}"
        if report.examples[rule] and report.examples[rule] not in report.renderings:
            yield f"    {report.examples[rule]}"
    yield ""
