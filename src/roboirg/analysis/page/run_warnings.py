"""Warnings above the results: incomplete or mixed runs, and missing references."""

from __future__ import annotations

import operator
from collections import Counter
from collections.abc import Iterable
from itertools import combinations
from typing import NamedTuple

from roboirg.analysis.measures.comparison import compare
from roboirg.analysis.measures.comparison_text import sentences
from roboirg.analysis.measures.headline import headline_notes
from roboirg.analysis.measures.heard_rates import heard_notes
from roboirg.analysis.page.episodes import JsonObject, PageEpisodes
from roboirg.analysis.results.frame import MISSING
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.analysis.tables.table_notes import findings_of
from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted, verb_for
from roboirg.core.word_pools import words_label
from roboirg.language.settings import EXPLICIT
from roboirg.records.mixing import mixtures
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
    "code": "code",
    "verdict code": "verdict_code",
}
"""Facts in the head of the page, and the fields of records that hold them."""


class Notice(NamedTuple):
    """A sentence above the results, and its kind: ``warning`` or ``note``."""

    kind: str
    text: str


def run_warnings(episodes: PageEpisodes) -> list[Notice]:
    """Return the sentences at the head of the page: warnings, and then notes.

    Warnings are about missing episodes, errors, mixed versions and cut prompts; notes about missing
    references, private splits and the headline number.
    """
    warnings = list(_incomplete(episodes))
    warnings += mixtures(episodes.records)
    warnings += heard_notes(episodes.data.frame, episodes.names)
    notes = [*findings_of(episodes.data.frame), *_without_reference(episodes)]
    notes += _private(episodes)
    notes += headline_notes(episodes.data.cells, episodes.names)
    notices = [Notice("warning", warning) for warning in warnings]
    notices += [Notice("note", note) for note in notes]
    return notices


class LabeledFact(NamedTuple):
    """A fact in the head of the page."""

    label: str
    text: str


def facts_of(episodes: PageEpisodes) -> list[LabeledFact]:
    """Return the facts of the run at the head of the page, such as its versions.

    A fact has the distinct values of all records; those that no record has are left out.
    """
    records = episodes.records
    times = [record.started_at for record in records]
    facts = [
        LabeledFact("run", " against ".join(episodes.runs)),
        LabeledFact("played", _period(_minute(min(times)), _minute(max(times)))),
    ]
    for label, field in _FACTS.items():
        values = set(map(operator.attrgetter(field), records))
        if label == "words":
            values = set(map(words_label, values))
        values.discard(None)
        text = ", ".join(sorted(map(str, values)))
        if text:
            facts.append(LabeledFact(label, text))
    return facts


def _minute(time: str) -> str:
    """Return a time without its seconds: ``2026-01-02 03:04`` for ``2026-01-02T03:04:05Z``."""
    return time[:16].replace("T", " ")


def comparisons(episodes: PageEpisodes) -> list[JsonObject]:
    """Return comparisons of two policies in sentences, with the policies' numbers left and right.

    There are at most `MAX_COMPARISONS`. A policy with its own words is not compared with a control
    arm, which has others.
    """
    found: list[JsonObject] = []
    for (left, first), (right, second) in combinations(enumerate(episodes.names), 2):
        is_same_arm = first.conditions.arm == second.conditions.arm
        if is_same_arm and len(found) < MAX_COMPARISONS:
            words = _compared(episodes, first, second)
            found.append({"left": left, "right": right, "sentences": words})
    return found


def _compared(episodes: PageEpisodes, first: PolicyRun, second: PolicyRun) -> list[str]:
    """Return the comparison of two policies in sentences, or why they cannot be compared."""
    frame = episodes.data.frame
    try:
        comparison = compare(frame.where(run=first), frame.where(run=second))
    except InvalidValueError as error:
        return [str(error)]
    return list(sentences(comparison, episodes.names[first], episodes.names[second]))


def _incomplete(episodes: PageEpisodes) -> Iterable[str]:
    """Yield sentences on planned episodes that were not played, and on those with an error."""
    missing = list(episodes.data.frame["outcome"]).count(MISSING)
    total = len(episodes.all)
    if missing:
        have = verb_for(missing, "have")
        yield (
            f"Incomplete: {missing} of {counted(missing + total, 'planned episode')} {have} not "
            "been played. Cells and averages that lack some are marked “…”."
        )
    errors: Counter[str] = Counter()
    for episode in episodes.all:
        if episode.record.outcome == "error":
            errors[episode.record.error or "unknown"] += 1
    if errors:
        kinds = ", ".join(f"{count} {kind}" for kind, count in errors.most_common())
        yield (
            f"{errors.total()} of {counted(total, 'episode')} ended in an error ({kinds}). Errors "
            "are left out of the rates; cells and averages with errors are marked “!”."
        )


def _without_reference(episodes: PageEpisodes) -> Iterable[str]:
    """Yield sentences on missing references: a policy that guesses, and explicit instructions."""
    if len(episodes.names) == 1:
        yield (
            "Only one policy: without the forgetful listener’s results next to it, a rate does not "
            "show how much of it is chance (roboirg tables RUN --floors chance adds the level)."
        )
    if all(key.options.setting != EXPLICIT for key in episodes.data.cells):
        yield "Explicit was not played, so there is no gap to it."


def _private(episodes: PageEpisodes) -> Iterable[str]:
    """Yield a sentence for each private split of episodes whose secret salt is not known here."""
    for split in sorted({episode.record.split for episode in episodes.all}):
        try:
            check_salt(split)
        except MissingSaltError:
            yield (
                f"The episodes of {split} are private: without their salt ({SALT_VARIABLE}) this "
                "page cannot say which are missing, and lacks stages and resolved words."
            )


def _period(first: str, last: str) -> str:
    """Return the period between two times: ``2026-01-02 03:04 to 03:09 UTC``.

    The day stands once if both are on the same one. Times are texts such as ``2026-01-02 03:04``.
    """
    if first == last:
        return f"{first} UTC"
    day, _, clock_time = last.partition(" ")
    is_same_day = first.startswith(day)
    return f"{first} to {clock_time if is_same_day else last} UTC"
