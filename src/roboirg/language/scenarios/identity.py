"""Which words are said, by what they are: two digests are equal only if the words are."""

from __future__ import annotations

import functools
import json
from collections.abc import Iterable

from msgspec.structs import replace

from roboirg.core.instruction_options import DEFAULT_LANGUAGE
from roboirg.core.word_pools import PoolName
from roboirg.language.scenarios.scenario_file import general, task_scenarios
from roboirg.language.templates import LANGUAGE_VERSIONS
from roboirg.util.short_hash import short_hash


def words_of(task: str, pool: PoolName, language: int) -> str:
    """Return which words a task has in a pool, such as ``PickXtimes/test@1a2b3c4d5e6f``.

    Empty in the usual language, whose words are code: its version is enough.
    """
    if language == DEFAULT_LANGUAGE:
        return ""
    return f"{task}/{pool}@{words_digest(task, pool)}"


def language_label(tasks: Iterable[str], pool: PoolName, language: int) -> str:
    """Return the version of a language, followed by which words of each task it has."""
    words = [words_of(task, pool, language) for task in tasks]
    return " ".join([LANGUAGE_VERSIONS[language], *words]).strip()


@functools.cache
def words_digest(task: str, pool: PoolName) -> str:
    """Return a hash of all that can be said of a task in a pool; ``none`` without words.

    Neither comments nor the order of scenarios and of their sentences change it. The order of a
    list does, since its entries are drawn by their numbers.
    """
    words = task_scenarios(task)
    if words is None:
        return "none"
    scenarios: list[list[str]] = []
    for scenario in words.scenarios:
        if scenario.fields.pool == pool:
            # Which other tasks say it, too, does not matter.
            needs = replace(scenario.fields.needs, tasks=())
            fields = replace(scenario.fields, needs=needs)
            scenarios.append([repr(fields), repr(sorted(scenario.texts.items()))])
    people = list(general().people.items())  # in their order, by which they are drawn
    stated = repr(sorted(words.stated.items()))
    commands = words.commands[pool]
    said = [people, general().distractors[pool], stated, commands, sorted(scenarios)]
    return short_hash(json.dumps(said))
