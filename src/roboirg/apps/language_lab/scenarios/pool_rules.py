"""What the two pools may not share, over all tasks: frames, sentences, introductions."""

from __future__ import annotations

import difflib
import functools
import re
from collections.abc import Iterator, Sequence

from roboirg.apps.language_lab.scenarios.sentence_rules import blanked, literal
from roboirg.language.scenarios.scenario import Scenario
from roboirg.language.scenarios.scenario_file import task_scenarios
from roboirg.tasks import all_tasks

SIMILAR = 0.7
"""Share of words from which two introductions are the same one with other nouns."""


@functools.cache
def written_scenarios() -> tuple[Scenario, ...]:
    """Return the scenarios of all tasks, each once, though several tasks may say it."""
    found: dict[tuple[str, str, str, str], Scenario] = {}
    for task in all_tasks().values():
        words = task_scenarios(task.name)
        for scenario in words.scenarios if words else ():
            fields = scenario.fields
            found[task.words, fields.pool, fields.setting, fields.frame] = scenario
    return tuple(found.values())


def shared_with_the_other_pool(scenario: Scenario, known: Sequence[Scenario]) -> Iterator[str]:
    """Yield what a scenario shares with one of the other pool: of `known`, or of ours."""
    own, words = set(blanked(scenario)), _introduction(scenario)
    matcher = difflib.SequenceMatcher(autojunk=False)
    matcher.set_seq2(words)
    found: dict[str, None] = {}
    for other in (*known, *written_scenarios()):
        if other.fields.pool == scenario.fields.pool:
            continue
        for shared in sorted(own.intersection(blanked(other))):
            found[f"the other pool has {shared!r}, too"] = None
        matcher.set_seq1(_introduction(other))
        if matcher.ratio() >= SIMILAR:
            alike = literal(other.text("introduction"))
            found[f"its introduction is that of the other pool with other nouns: {alike!r}"] = None
    yield from found


def _introduction(scenario: Scenario) -> list[str]:
    return re.findall(r"[\w']+", literal(scenario.text("introduction")).lower())
