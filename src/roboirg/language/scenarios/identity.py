"""Which words are said, by what they are: two digests are equal only if the words are."""

from __future__ import annotations

import functools
import json
from collections.abc import Iterable

from msgspec.structs import replace

from roboirg.core.word_pools import PoolName, outside_words
from roboirg.language.scenarios.scenario import TaskScenarios
from roboirg.language.scenarios.scenario_file import general, setting_scenarios
from roboirg.language.scenarios.wording_store import task_words
from roboirg.language.settings import EXPLICIT
from roboirg.language.word_sampler import LANGUAGE_VERSION
from roboirg.util.short_hash import short_hash


def words_of(
    task: str,
    pool: PoolName,
    setting: str = EXPLICIT,
    wordings: str | None = None,
) -> str:
    """Return the name of the words that a task has in a pool: ``PickXtimes/test@1a2b3c4d5e6f``.

    The part after *@* is a digest of the words, so equal names mean equal words; records keep the
    name. ``PickXtimes/test/lab@3c4d5e6f1a2b`` in a setting *lab* whose own file serves the task.

    Args:
        task: its name.
        pool: ``train`` or ``test``.
        setting: in which they are said.
        wordings: the identity of an open wording file, whose words come before ours; None for ours.
    """
    name = f"{task}/{pool}"
    if task in setting_scenarios(setting):
        name += f"/{setting}"
    return f"{name}@{words_digest(task, pool, setting, outside_words(wordings))}"


def language_label(
    tasks: Iterable[str],
    pool: PoolName,
    settings: Iterable[str] = (),
    wordings: str | None = None,
) -> str:
    """Return the version of the language, followed by the words of each task in some settings.

    ``4.7.0 PickXtimes/test@1a2b3c4d5e6f``; each task counts in the explicit setting, too, and each
    name once. The arguments are as for `words_of`.
    """
    names = (EXPLICIT, *settings)
    words: list[str] = []
    for task in tasks:
        words += [words_of(task, pool, setting, wordings) for setting in names]
    return " ".join([LANGUAGE_VERSION, *dict.fromkeys(words)]).strip()


@functools.cache
def words_digest(
    task: str, pool: PoolName, setting: str = EXPLICIT, wordings: str | None = None
) -> str:
    """Return a hash of all that can be said of a task in a pool; ``none`` without words.

    It is of one file: the setting's own, or else the task's. A file that another package brings
    for tasks of ours changes the digest of no other setting.

    Neither comments nor the order of scenarios and of their sentences change it. The order of a
    list does, since its entries are drawn by their numbers. Published records have these digests,
    so what is hashed must stay as it is.
    """
    words = task_words(task, setting, wordings)
    if words is None:
        return "none"
    shared = general()
    said = [
        list(shared.people.items()),  # in their order, by which they are drawn
        shared.distractors[pool],
        repr(sorted(words.stated.items())),
        words.commands.get(pool, ()),
        _scenarios_in(words, pool),
    ]
    if words.literals:
        said.append(repr(sorted(words.literals.items(), key=repr)))
    return short_hash(json.dumps(said))


def _scenarios_in(words: TaskScenarios, pool: PoolName) -> list[list[str]]:
    """Return each scenario of a pool as two texts, its fields and its sentences, in a fixed order.

    So the same scenarios in another order of the file give the same list.
    """
    scenario_texts: list[list[str]] = []
    for scenario in words.scenarios:
        if scenario.fields.is_in(pool):
            # Which other tasks say it, too, does not matter.
            needs = replace(scenario.fields.needs, tasks=())
            fields = replace(scenario.fields, needs=needs)
            scenario_texts.append([repr(fields), repr(sorted(scenario.texts.items()))])
    return sorted(scenario_texts)
