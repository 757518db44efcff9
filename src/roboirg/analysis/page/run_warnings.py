"""What a reader has to know before any figure: what is amiss, mixed, or alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from roboirg.analysis.page.entries import EpisodeEntries, Run
from roboirg.analysis.page.matrix import SEED
from roboirg.analysis.stats.comparison import compare
from roboirg.analysis.stats.comparison_text import sentences
from roboirg.analysis.stats.samples import PolicyRun, Versions
from roboirg.core.errors import InvalidValueError

MOST_PAIRS = 6
"""Of policies that are compared in words."""


class RunWarning(NamedTuple):
    """A sentence above the figures; `kind` is warning or note."""

    kind: str
    text: str


def run_warnings(entries: EpisodeEntries) -> list[RunWarning]:
    """What is incomplete, failed, mixed, or cannot be compared."""
    return [
        *(RunWarning("warning", text) for text in _amiss(entries)),
        *(RunWarning("warning", text) for text in _mixed(entries)),
        *(RunWarning("note", text) for text in _alone(entries)),
    ]


def facts_of(runs: Sequence[Run]) -> list[tuple[str, str]]:
    """What the head of the page says about the runs."""
    records = [record for run in runs for record in run.records]
    times = sorted(record.started_at[:16].replace("T", " ") for record in records)
    facts = [
        ("run", " against ".join(run.name for run in runs)),
        ("played", _span(times[0], times[-1]) if times else ""),
        *(
            (label, ", ".join(sorted({_said(getattr(one, name)) for one in records})))
            for label, name in (
                ("split", "split"),
                ("step limit", "max_steps"),
                ("roboirg", "package_version"),
                ("language", "language_version"),
                ("environment", "environment_version"),
                ("drawn by", "render_device"),
            )
        ),
    ]
    return [(label, value.strip(", ")) for label, value in facts if value.strip(", ")]


def comparisons(entries: EpisodeEntries) -> list[dict[str, Any]]:
    """What can be said of each two policies, in words; the first few of them."""
    found = []
    names = list(entries.names)
    for first, second in list(combinations(range(len(names)), 2))[:MOST_PAIRS]:
        said = _compared(entries, names[first], names[second])
        found.append({"left": first, "right": second, "said": said})
    return found


def _compared(entries: EpisodeEntries, first: PolicyRun, second: PolicyRun) -> list[str]:
    ours, theirs = (
        {key: sample for key, sample in entries.samples.items() if key[0] == who}
        for who in (first, second)
    )
    try:
        comparison = compare(ours, theirs, np.random.default_rng(SEED))
    except InvalidValueError as error:
        return [str(error)]
    return list(sentences(comparison, entries.names[first], entries.names[second]))


def _amiss(entries: EpisodeEntries) -> Iterable[str]:
    missing = sum(sample.missing for sample in entries.samples.values())
    if missing:
        planned = missing + len(entries.all)
        yield (
            f"Incomplete: {missing} of {planned} planned episodes have not been played. Cells and "
            "averages that lack some are marked “…”."
        )
    errors = Counter(
        entry.record.error or "unknown" for entry in entries.all if entry.record.outcome == "error"
    )
    if errors:
        kinds = ", ".join(f"{count} {kind}" for kind, count in errors.most_common())
        yield (
            f"{errors.total()} of {len(entries.all)} episodes ended in an error ({kinds}). They "
            "are in no rate; cells and averages that lack them are marked “!”."
        )


def _mixed(entries: EpisodeEntries) -> Iterable[str]:
    for name in ("language", "environment"):
        found = {getattr(Versions.of(entry.record), name) for entry in entries.all}
        if len(found) > 1:
            yield (
                f"Mixed versions of the {name}: {', '.join(sorted(map(str, found)))}. "
                "They stand apart and are never averaged."
            )
    for policy in dict.fromkeys(who.policy for who in entries.names):
        own = [who for who in entries.names if who.policy == policy]
        versions = {who.versions.policy for who in own if who.versions is not None}
        if len(versions) > 1:
            yield (
                f"{policy} played in several versions: {', '.join(sorted(versions))}. "
                "They stand apart and are never averaged."
            )
        for run in dict.fromkeys(who.run for who in own):
            rules = {who.rules for who in own if who.run == run}
            if len(rules) > 1:
                yield f"{policy} played under {len(rules)} sets of rules, which stand apart."
    codes = {entry.record.code for entry in entries.all}
    if len(codes) > 1:
        yield f"Played with {len(codes)} different states of the package’s code."


def _alone(entries: EpisodeEntries) -> Iterable[str]:
    if len(entries.names) == 1:
        yield (
            "One policy alone: without the forgetful listener’s figures beside it, a rate does not "
            "say how much of it is chance (roboirg tables RUN --chance adds them)."
        )
    if all(told.setting != "explicit" for _, _, told in entries.samples):
        yield "Explicit was not played, so there is no gap to it."


def _said(value: object) -> str:
    return "" if value is None else str(value)


def _span(first: str, last: str) -> str:
    """From one time to another, such as 2026-01-02 03:04; the day only once."""
    if first == last:
        return f"{first} UTC"
    day, _, minute = last.partition(" ")
    return f"{first} to {minute if first.startswith(day) else last} UTC"
