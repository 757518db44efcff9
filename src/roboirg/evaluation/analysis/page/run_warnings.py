"""Warnings above the results: incomplete or mixed runs, and missing references."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import Any, NamedTuple

from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted, verb_for
from roboirg.evaluation.analysis.page.entries import EpisodeEntries, Run
from roboirg.evaluation.analysis.stats.cells import FAIRNESS, EvalConditions, PolicyRun, Versions
from roboirg.evaluation.analysis.stats.comparison import compare
from roboirg.evaluation.analysis.stats.comparison_text import sentences
from roboirg.evaluation.analysis.stats.headline import headline_notes
from roboirg.evaluation.analysis.stats.heard_rates import count_heard, heard_notes
from roboirg.language.settings import EXPLICIT
from roboirg.tasks.splits.private_splits import SALT_VARIABLE, MissingSaltError, check_salt

MAX_COMPARISONS = 6
"""Pairs of policies that are compared in words."""


class RunWarning(NamedTuple):
    """A sentence above the results; `kind` is ``warning`` or ``note``."""

    kind: str
    text: str


def run_warnings(entries: EpisodeEntries) -> list[RunWarning]:
    """Return what is incomplete, failed, mixed, or cannot be compared."""
    return [
        *(RunWarning("warning", text) for text in _incomplete(entries)),
        *(RunWarning("warning", text) for text in _mixed(entries)),
        *(RunWarning("warning", text) for text in _cut(entries)),
        *(RunWarning("note", text) for text in _without_reference(entries)),
        *(RunWarning("note", text) for text in _private(entries)),
        *(RunWarning("note", text) for text in headline_notes(entries.cells, entries.names)),
    ]


def facts_of(runs: Sequence[Run]) -> list[tuple[str, str]]:
    """Return the facts in the head of the page, each with its label."""
    records = [record for run in runs for record in run.records]
    times = sorted(record.started_at[:16].replace("T", " ") for record in records)
    conditions = [EvalConditions.of(record) for record in records]
    facts = [
        ("run", " against ".join(run.name for run in runs)),
        ("played", _period(times[0], times[-1]) if times else ""),
        *(
            (label, ", ".join(sorted({one.text(name) for one in conditions})))
            for label, name in (
                ("split", "split"),
                ("words", "wordings"),
                ("step limit", "max_steps"),
            )
        ),
        *(
            (label, ", ".join(sorted({_text(getattr(one, name)) for one in records})))
            for label, name in (
                ("roboirg", "package_version"),
                ("language", "language_version"),
                ("environment", "environment_version"),
                ("rendered on", "render_device"),
            )
        ),
    ]
    return [(label, value.strip(", ")) for label, value in facts if value.strip(", ")]


def comparisons(entries: EpisodeEntries) -> list[dict[str, Any]]:
    """Return the comparison of the first pairs of policies in words."""
    names = list(entries.names)
    arms = [one.conditions.arm for one in names]
    alike = [pair for pair in combinations(range(len(names)), 2) if arms[pair[0]] == arms[pair[1]]]
    pairs = alike[:MAX_COMPARISONS]
    return [
        {
            "left": first,
            "right": second,
            "sentences": _compared(entries, names[first], names[second]),
        }
        for first, second in pairs
    ]


def _compared(entries: EpisodeEntries, first: PolicyRun, second: PolicyRun) -> list[str]:
    ours, theirs = (
        {key: cell for key, cell in entries.cells.items() if key.policy_run == policy_run}
        for policy_run in (first, second)
    )
    try:
        comparison = compare(ours, theirs)
    except InvalidValueError as error:
        return [str(error)]
    return list(sentences(comparison, entries.names[first], entries.names[second]))


def _incomplete(entries: EpisodeEntries) -> Iterable[str]:
    missing = sum(cell.missing for cell in entries.cells.values())
    total = len(entries.all)
    if missing:
        have = verb_for(missing, "have")
        yield (
            f"Incomplete: {missing} of {counted(missing + total, 'planned episode')} {have} not "
            "been played. Cells and averages that lack some are marked “…”."
        )
    errors = Counter(
        entry.record.error or "unknown" for entry in entries.all if entry.record.outcome == "error"
    )
    if errors:
        kinds = ", ".join(f"{count} {kind}" for kind, count in errors.most_common())
        yield (
            f"{errors.total()} of {counted(total, 'episode')} ended in an error ({kinds}). Errors "
            "are left out of the rates; cells and averages with errors are marked “!”."
        )


def _mixed(entries: EpisodeEntries) -> Iterable[str]:
    for name in ("language", "environment"):
        found = {getattr(Versions.of(entry.record), name) for entry in entries.all}
        if len(found) > 1:
            yield (
                f"Mixed versions of the {name}: {', '.join(sorted(map(str, found)))}. "
                "They have separate heat maps and are never averaged."
            )
    conditions = {EvalConditions.of(entry.record) for entry in entries.all}
    for name, plural in FAIRNESS.items():
        values = {one.text(name) for one in conditions}
        if len(values) > 1:
            yield (
                f"Mixed {plural}: {', '.join(sorted(values))}. "
                "They have separate heat maps and are never averaged."
            )
    for policy in dict.fromkeys(one.policy for one in entries.names):
        yield from _mixed_policy(policy, [one for one in entries.names if one.policy == policy])
    codes = {entry.record.code for entry in entries.all}
    if len(codes) > 1:
        yield f"Played with {len(codes)} different states of the package’s code."


def _cut(entries: EpisodeEntries) -> Iterable[str]:
    counts = count_heard((entry.policy_run, entry.record) for entry in entries.all)
    return heard_notes(counts, entries.names)


def _mixed_policy(policy: str, policy_runs: Sequence[PolicyRun]) -> Iterable[str]:
    versions = {one.versions.policy for one in policy_runs if one.versions is not None}
    if len(versions) > 1:
        yield (
            f"{policy} played in several versions: {', '.join(sorted(versions))}. "
            "They have separate heat maps and are never averaged."
        )
    for run in dict.fromkeys(one.run for one in policy_runs):
        conditions = {one.conditions for one in policy_runs if one.run == run}
        if len(conditions) > 1:
            yield (
                f"{policy} played under {len(conditions)} sets of conditions, which have "
                "separate heat maps."
            )


def _without_reference(entries: EpisodeEntries) -> Iterable[str]:
    if len(entries.names) == 1:
        yield (
            "Only one policy: without the forgetful listener’s results next to it, a rate does not "
            "show how much of it is chance (roboirg tables RUN --floors chance adds the level)."
        )
    if all(key.options.setting != EXPLICIT for key in entries.cells):
        yield "Explicit was not played, so there is no gap to it."


def _private(entries: EpisodeEntries) -> Iterable[str]:
    for split in sorted({entry.record.split for entry in entries.all}):
        try:
            check_salt(split)
        except MissingSaltError:
            yield (
                f"The episodes of {split} are private: without their salt ({SALT_VARIABLE}) this "
                "page cannot say which are missing, and lacks stages and resolved words."
            )


def _text(value: object) -> str:
    return "" if value is None else str(value)


def _period(first: str, last: str) -> str:
    """Return a period such as ``2026-01-02 03:04 to 03:09 UTC``; names the day once if equal."""
    if first == last:
        return f"{first} UTC"
    day, _, minute = last.partition(" ")
    return f"{first} to {minute if first.startswith(day) else last} UTC"
