"""What the page's filters read: for each filter a column with the index of each episode's value.

A page of ten thousand episodes must open and filter at once.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, get_args

from roboirg.core.episode import DIFFICULTIES
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.page.episodes import PageEpisodes
from roboirg.evaluation.analysis.results.frame import suite, task_order
from roboirg.evaluation.analysis.results.option_labels import options_label, options_sort_key
from roboirg.evaluation.analysis.tables.diagnostic_tables import FAILURES, UNATTRIBUTED
from roboirg.evaluation.records.mixing import FAIRNESS
from roboirg.evaluation.records.record import ERROR_KINDS, Outcome, Summary

_KINDS: dict[str, str] = {
    **FAILURES,
    UNATTRIBUTED: UNATTRIBUTED,
    **dict.fromkeys(ERROR_KINDS, "error"),
}
"""Failures and errors in order, each with its kind."""


class Filter(NamedTuple):
    """A filter of the page.

    Attributes:
        label: its name in words.
        values: that can be chosen.
        column: for each episode the index of its value; -1 without one.
        groups: for each value the heading above it; empty without headings.
    """

    label: str
    values: Sequence[str]
    column: Sequence[int]
    groups: Sequence[str] = ()


def make_filters(episodes: PageEpisodes) -> dict[str, Filter]:
    """Return the filters by name, in order."""
    records = [one.record for one in episodes.all]
    policies = {run: place for place, run in enumerate(episodes.names)}
    played_by = [policies[one.policy_run] for one in episodes.all]
    tasks = task_order({one.task for one in records})
    suites = {task: suite(task) or "other tasks" for task in tasks}
    options = sorted({one.column for one in records}, key=options_sort_key)
    settings = {one: setting_label(one) for one in options}
    seeds = [str(one.policy_seed) for one in records]
    return {
        "policy": Filter("policy", list(episodes.names.values()), played_by),
        "task": _filter("task", [one.task for one in records], tasks, suites),
        "setting": _filter("setting", [settings[one.column] for one in records], settings.values()),
        "form": _filter("form", [one.form for one in records], [one.form for one in options]),
        "difficulty": _filter("difficulty", [one.difficulty for one in records], DIFFICULTIES),
        "outcome": _filter("outcome", [one.outcome for one in records], get_args(Outcome)),
        "failure": _filter("why it failed", list(map(_failure, records)), _KINDS, _KINDS),
        "seed": _filter("policy seed", seeds, sorted(seeds, key=int)),
    }


def _filter(
    label: str,
    values: Sequence[str | None],
    order: Iterable[str],
    groups: Mapping[str, str] | None = None,
) -> Filter:
    """Return a filter by values, those of `order` first; None has no value."""
    found = {one for one in values if one is not None}
    ordered = [one for one in dict.fromkeys((*order, *sorted(found))) if one in found]
    places: dict[str | None, int] = {one: place for place, one in enumerate(ordered)}
    above = [groups[one] for one in ordered] if groups else []
    return Filter(label, ordered, [places.get(one, -1) for one in values], above)


def make_numbers(episodes: PageEpisodes) -> dict[str, Sequence[int | str]]:
    """Return the columns that are no filters.

    Episodes of the same scene have the same number in the column ``scene``; among them those that
    can be compared, in the column ``pair``.
    """
    fairness = operator.attrgetter(*(trait.path for trait in FAIRNESS))
    records = [one.record for one in episodes.all]
    scenes = [(one.task, one.split, one.episode) for one in records]
    pairs = [
        (*scene, one.policy_seed, one.column, fairness(one))
        for scene, one in zip(scenes, records, strict=True)
    ]
    return {
        "key": [one.key for one in episodes.all],
        "episode": [one.episode for one in records],
        "steps": [one.steps for one in records],
        "scene": _numbers(scenes),
        "pair": _numbers(pairs),
    }


def _numbers(keys: Iterable[tuple[object, ...]]) -> list[int]:
    """Return a number for each key, the same for equal ones."""
    found: dict[tuple[object, ...], int] = {}
    return [found.setdefault(key, len(found)) for key in keys]


def setting_label(options: InstructionOptions) -> str:
    """Return the label of options whatever the form, which is a filter of its own."""
    return options_label(replace(options, form="implicit"))


def _failure(record: Summary) -> str | None:
    """Return the name of an episode's failure or error; None for a success.

    A name that this version does not have is not attributed.
    """
    if record.outcome == "success":
        return None
    cause = record.attribution
    return record.error or (cause.failure if cause and cause.failure in FAILURES else UNATTRIBUTED)
