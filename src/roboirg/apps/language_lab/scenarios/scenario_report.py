"""Checked scenarios in lines of text, for their author."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import get_args

from roboirg.apps.language_lab.scenarios.scenario_check import ScenarioReport
from roboirg.core.episode import Episode
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted
from roboirg.core.word_pools import POOLS
from roboirg.language.generator import find_refusal
from roboirg.language.scenarios.scenario import ScenarioSetting
from roboirg.language.settings import settings_of
from roboirg.language.token_counts import USUAL_LIMIT
from roboirg.tasks import get_task


def report_lines(report: ScenarioReport) -> Iterator[str]:
    """Yield what an author wants to know: texts, length, scenes, and every broken rule."""
    fields, fits = report.scenario.fields, len(report.scenes)
    yield f"{fields.frame} ({fields.setting}, {fields.pool})"
    yield from (f"  {text}" for text in report.renderings)
    yield (
        f"  {report.longest[0]} of {USUAL_LIMIT} tokens; fits {counted(fits, 'scene')}; "
        f"the interpreter does not read {report.refused} of {counted(report.read, 'text')}."
    )
    if report.misread:
        yield f"  It gets another goal from {len(report.misread)}; if you do not, tell its authors:"
        yield f"    {report.misread[0]}"
    if report.open < fits:
        yield f"  In {counted(fits - report.open, 'scene')} the command alone gives the goal."
    for rule, number in report.broken.items():
        example = report.examples[rule]
        often = f" (in {counted(number, 'scene')})" if example else ""
        yield f"  BROKEN {rule}{often}"
        if example and example not in report.renderings:
            yield f"    {example}"
    yield ""


def coverage_lines(
    task: str, reports: Sequence[ScenarioReport], episodes: Sequence[Episode]
) -> Iterator[str]:
    """Yield how many scenarios each pool and setting has, and how many scenes none of them fits.

    The last line names those that have none.
    """
    missing: list[str] = []
    settings = [one for one in get_args(ScenarioSetting) if one in settings_of(get_task(task))]
    for pool, name in itertools.product(POOLS, settings):
        fits = [
            one.scenes
            for one in reports
            if (one.scenario.fields.pool, one.scenario.fields.setting) == (pool, name)
        ]
        without = [
            one.key
            for one in episodes
            if not any(one.key in scenes for scenes in fits)
            and find_refusal(one, InstructionOptions(name)) is None
        ]
        such = (
            f"; {counted(len(without), 'scene')} without one, such as {without[0]}"
            if without
            else ""
        )
        if fits:
            yield f"{name}, {pool}: {counted(len(fits), 'scenario')}{such}."
        else:
            missing.append(f"{name} ({pool})")
    if missing:
        yield f"No scenarios yet: {', '.join(missing)}."
