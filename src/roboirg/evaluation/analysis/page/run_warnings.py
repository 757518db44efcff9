"""Warnings above the results: incomplete or mixed runs, and missing references."""

from __future__ import annotations

import operator
from collections import Counter
from collections.abc import Iterable
from itertools import chain, combinations

from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted, verb_for
from roboirg.core.word_pools import words_label
from roboirg.evaluation.analysis.page.episodes import JsonObject, PageEpisodes
from roboirg.evaluation.analysis.results.frame import MISSING
from roboirg.evaluation.analysis.results.policy_run import PolicyRun
from roboirg.evaluation.analysis.stats.comparison import compare
from roboirg.evaluation.analysis.stats.comparison_text import sentences
from roboirg.evaluation.analysis.stats.headline import headline_notes
from roboirg.evaluation.analysis.stats.heard_rates import heard_notes
from roboirg.evaluation.records.mixing import mixtures
from roboirg.language.settings import EXPLICIT
from roboirg.tasks.splits.private_splits import SALT_VARIABLE, MissingSaltError, check_salt

MAX_COMPARISONS = 6
"""Pairs of policies that are compared in words."""


_FACTS = {
    "split": "split",
    "words": "options.wordings",
    "step limit": "environment.max_steps",
    "roboirg": "package_version",
    "language": "language_version",
    "environment": "environment_version",
    "rendered on": "render_device",
}
"""Facts in the head of the page, and the fields of records that hold them."""


def run_warnings(episodes: PageEpisodes) -> list[tuple[str, str]]:
    """Return what is incomplete, failed, mixed, or cannot be compared.

    These are sentences above the results, each after its kind, ``warning`` or ``note``.
    """
    heard = heard_notes(episodes.data.frame, episodes.names)
    headline = headline_notes(episodes.data.cells, episodes.names)
    kinds = {
        "warning": (_incomplete(episodes), mixtures([one.record for one in episodes.all]), heard),
        "note": (_without_reference(episodes), _private(episodes), headline),
    }
    return [(kind, text) for kind, parts in kinds.items() for text in chain(*parts)]


def facts_of(episodes: PageEpisodes) -> list[tuple[str, str]]:
    """Return the facts in the head of the page, each with its label."""
    records = [one.record for one in episodes.all]
    times = [record.started_at[:16].replace("T", " ") for record in records]
    facts = {
        "run": " against ".join(episodes.runs),
        "played": _period(min(times), max(times)),
    }
    for label, field in _FACTS.items():
        values = set(map(operator.attrgetter(field), records))
        words = map(words_label, values) if label == "words" else map(str, values - {None})
        facts[label] = ", ".join(sorted(words))
    return [(label, text) for label, text in facts.items() if text]


def comparisons(episodes: PageEpisodes) -> list[JsonObject]:
    """Return the comparison of the first pairs of policies in words."""
    found: list[JsonObject] = []
    for (left, first), (right, second) in combinations(enumerate(episodes.names), 2):
        if first.conditions.arm == second.conditions.arm and len(found) < MAX_COMPARISONS:
            words = _compared(episodes, first, second)
            found.append({"left": left, "right": right, "sentences": words})
    return found


def _compared(episodes: PageEpisodes, first: PolicyRun, second: PolicyRun) -> list[str]:
    ours, theirs = (episodes.data.frame.where(run=policy_run) for policy_run in (first, second))
    try:
        comparison = compare(ours, theirs)
    except InvalidValueError as error:
        return [str(error)]
    return list(sentences(comparison, episodes.names[first], episodes.names[second]))


def _incomplete(episodes: PageEpisodes) -> Iterable[str]:
    missing = [*episodes.data.frame["outcome"]].count(MISSING)
    total = len(episodes.all)
    if missing:
        have = verb_for(missing, "have")
        yield (
            f"Incomplete: {missing} of {counted(missing + total, 'planned episode')} {have} not "
            "been played. Cells and averages that lack some are marked “…”."
        )
    errors = Counter(
        one.record.error or "unknown" for one in episodes.all if one.record.outcome == "error"
    )
    if errors:
        kinds = ", ".join(f"{count} {kind}" for kind, count in errors.most_common())
        yield (
            f"{errors.total()} of {counted(total, 'episode')} ended in an error ({kinds}). Errors "
            "are left out of the rates; cells and averages with errors are marked “!”."
        )


def _without_reference(episodes: PageEpisodes) -> Iterable[str]:
    if len(episodes.names) == 1:
        yield (
            "Only one policy: without the forgetful listener’s results next to it, a rate does not "
            "show how much of it is chance (roboirg tables RUN --floors chance adds the level)."
        )
    if all(key.options.setting != EXPLICIT for key in episodes.data.cells):
        yield "Explicit was not played, so there is no gap to it."


def _private(episodes: PageEpisodes) -> Iterable[str]:
    for split in sorted({one.record.split for one in episodes.all}):
        try:
            check_salt(split)
        except MissingSaltError:
            yield (
                f"The episodes of {split} are private: without their salt ({SALT_VARIABLE}) this "
                "page cannot say which are missing, and lacks stages and resolved words."
            )


def _period(first: str, last: str) -> str:
    """Return a period such as ``2026-01-02 03:04 to 03:09 UTC``; names the day once if equal."""
    if first == last:
        return f"{first} UTC"
    day, _, minute = last.partition(" ")
    return f"{first} to {minute if first.startswith(day) else last} UTC"
