"""The identity of words: what a task can say in a pool, as a digest."""

from __future__ import annotations

import functools

from roboirg.core.instruction_options import DEFAULT_LANGUAGE, InstructionOptions
from roboirg.core.word_pools import PoolName, pool_of
from roboirg.language.scenarios.scenario_file import general, task_scenarios
from roboirg.util.short_hash import short_hash


@functools.cache
def words_digest(task: str, pool: PoolName) -> str | None:
    """Return a digest of all words of a task in a pool; None if none have been written.

    Words are what was read: layout, comments and the order of scenarios do not matter.
    """
    words, shared = task_scenarios(task), general()
    if words is None:
        return None
    of_pool = [scenario for scenario in words.scenarios if scenario.fields.pool == pool]
    commands = {
        tuple(sorted(fields)): texts
        for (command_pool, fields), texts in words.commands.items()
        if command_pool == pool
    }
    parts = [
        *sorted(map(repr, of_pool)),
        *sorted(map(repr, commands.items())),
        *sorted(map(repr, words.stated.items())),
        repr(sorted(shared.people.items())),
        repr(shared.distractors[pool]),
    ]
    return short_hash("\n".join(parts))


def words_of(task: str, split: str, options: InstructionOptions) -> str | None:
    """Return the digest of the words of which an instruction is; None where a version names them.

    Language 3 has a version, which its words never change.
    """
    if options.language == DEFAULT_LANGUAGE:
        return None
    return words_digest(task, pool_of(split, options.wordings))
