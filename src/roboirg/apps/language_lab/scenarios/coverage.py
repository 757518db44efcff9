"""Which scenes a file of scenarios says nothing of, and which derivations."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import get_args

from roboirg.core.episode import Episode
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted
from roboirg.core.word_pools import POOLS
from roboirg.language.generator import request_of
from roboirg.language.scenarios.choice import choose, offers
from roboirg.language.scenarios.derived import derivations_of
from roboirg.language.scenarios.scenario import Scenario, ScenarioSetting, TaskScenarios
from roboirg.language.settings import all_settings, settings_of
from roboirg.tasks import get_task


def coverage_lines(words: TaskScenarios, episodes: Sequence[Episode]) -> Iterator[str]:
    """Yield a line for each pool and setting with scenarios: how many, and what none of them says.

    The last line names the others.
    """
    missing: list[str] = []
    for pool, name in itertools.product(POOLS, get_args(ScenarioSetting)):
        known = [
            one for one in words.scenarios if (one.fields.pool, one.fields.setting) == (pool, name)
        ]
        if known:
            options = InstructionOptions(name, language=4, wordings=pool)
            yield f"{name}, {pool}: {_covered(known, episodes, options)}."
        elif name in settings_of(get_task(words.task)):
            missing.append(f"{name} ({pool})")
    if missing:
        yield f"No scenarios yet: {', '.join(missing)}."


def _covered(
    known: Sequence[Scenario], episodes: Sequence[Episode], options: InstructionOptions
) -> str:
    """Return how many scenarios a setting has, and the scenes and derivations without one."""
    lacking: list[str] = []
    unsaid: set[str] = set()
    for episode in episodes:
        request = request_of(episode, options)
        if all_settings()[options.setting].refusal(request) is not None:
            continue
        if choose(request, options.setting, known) is None:
            lacking.append(episode.key)
        if options.setting == "reasoning":
            unsaid |= {
                ": ".join(filter(None, (one.pattern, one.relation, one.listed)))
                for one in derivations_of(request)
                if not any(offers(scenario, one) for scenario in known)
            }
    found = [counted(len(known), "scenario")]
    if lacking:
        found.append(f"{counted(len(lacking), 'scene')} without one, such as {lacking[0]}")
    if unsaid:
        found.append(f"no words for {', '.join(sorted(unsaid))}")
    return "; ".join(found)
