"""Which words are said, by what they are: two digests are equal only if the words are."""

from __future__ import annotations

import functools
import json
from collections.abc import Iterable

from msgspec.structs import replace

from roboirg.core.instruction_options import DEFAULT_LANGUAGE
from roboirg.core.word_pools import PoolName, outside_words
from roboirg.language.scenarios.scenario_file import general
from roboirg.language.scenarios.wording_store import task_words
from roboirg.language.templates import LANGUAGE_VERSIONS
from roboirg.util.short_hash import short_hash


def words_of(task: str, pool: PoolName, language: int, wordings: str | None = None) -> str:
    """Return which words a task has in a pool, such as ``PickXtimes/test@1a2b3c4d5e6f``.

    Empty in the usual language, whose words are code: its version is enough. `wordings` may be the
    identity of an open wording file, whose words come before ours.
    """
    if language == DEFAULT_LANGUAGE:
        return ""
    return f"{task}/{pool}@{words_digest(task, pool, outside_words(wordings))}"


def language_label(
    tasks: Iterable[str], pool: PoolName, language: int, wordings: str | None = None
) -> str:
    """Return the version of a language, followed by which words of each task it has."""
    words = [words_of(task, pool, language, wordings) for task in tasks]
    return " ".join([LANGUAGE_VERSIONS[language], *words]).strip()


@functools.cache
def words_digest(task: str, pool: PoolName, wordings: str | None = None) -> str:
    """Return a hash of all that can be said of a task in a pool; ``none`` without words.

    Neither comments nor the order of scenarios and of their sentences change it. The order of a
    list does, since its entries are drawn by their numbers.
    """
    words = task_words(task, wordings)
    if words is None:
        return "none"
    scenarios: list[list[str]] = []
    for scenario in words.scenarios:
        if scenario.fields.pool in (None, pool):
            # Which other tasks say it, too, does not matter.
            needs = replace(scenario.fields.needs, tasks=())
            fields = replace(scenario.fields, needs=needs)
            scenarios.append([repr(fields), repr(sorted(scenario.texts.items()))])
    people = list(general().people.items())  # in their order, by which they are drawn
    stated = repr(sorted(words.stated.items()))
    commands = words.commands.get(pool, ())
    said = [people, general().distractors[pool], stated, commands, sorted(scenarios)]
    if words.literals:
        said.append(repr(sorted(words.literals.items(), key=repr)))
    return short_hash(json.dumps(said))
