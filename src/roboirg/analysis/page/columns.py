"""What the page's filters read: for each filter a column with the index of each episode's value.

A page of ten thousand episodes must open and filter at once.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, get_args

from roboirg.analysis.page.episodes import PageEpisodes
from roboirg.analysis.results.frame import suite, task_order
from roboirg.analysis.results.option_labels import options_sort_key
from roboirg.analysis.tables.diagnostic_tables import FAILURE_KINDS, UNATTRIBUTED
from roboirg.core.episode import DIFFICULTIES
from roboirg.core.instruction_options import InstructionOptions, options_label
from roboirg.language import FORMS
from roboirg.records.mixing import FAIRNESS
from roboirg.records.record import ERROR_KINDS, Outcome, Summary

_KINDS: dict[str, str] = {
    **FAILURE_KINDS,
    UNATTRIBUTED: UNATTRIBUTED,
    **dict.fromkeys(ERROR_KINDS, "error"),
}
"""Failures and errors in order, each with its kind."""
_NO_VALUE = -1
"""Index of an episode that has no value in a filter."""


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
    """Return the page's filters of episodes by name, such as by task, setting and outcome.

    Each has the values that can be chosen, in the order of the benchmark and only if some episode
    has them, and the value of each episode.
    """
    records = episodes.records

    def values_of(name: str) -> list[str]:
        return [getattr(record, name) for record in records]

    seeds = [record.policy_seed for record in records]
    seed_order = map(str, sorted(set(seeds)))
    return {
        "policy": _policy_filter(episodes),
        "task": _task_filter(values_of("task")),
        "setting": _setting_filter(records),
        "form": _filter("form", values_of("form"), FORMS),
        "difficulty": _filter("difficulty", values_of("difficulty"), DIFFICULTIES),
        "outcome": _filter("outcome", values_of("outcome"), get_args(Outcome)),
        "failure": _filter("why it failed", list(map(_failure, records)), _KINDS, _KINDS),
        "seed": _filter("policy seed", list(map(str, seeds)), seed_order),
    }


def _task_filter(tasks: Sequence[str]) -> Filter:
    """Return the filter by task, below the names of the suites."""
    in_order = task_order(set(tasks))
    suites = {task: suite(task) or "other tasks" for task in in_order}
    return _filter("task", tasks, in_order, suites)


def _setting_filter(records: Iterable[Summary]) -> Filter:
    options = [record.column for record in records]
    in_order = sorted(set(options), key=options_sort_key)
    labels = {column: setting_label(column) for column in in_order}
    values = [labels[column] for column in options]
    return _filter("setting", values, labels.values())


def _policy_filter(episodes: PageEpisodes) -> Filter:
    """Return the filter by policy run, whose labels may be equal."""
    places = {policy_run: place for place, policy_run in enumerate(episodes.names)}
    column = [places[episode.policy_run] for episode in episodes.all]
    return Filter("policy", list(episodes.names.values()), column)


def _filter(
    label: str,
    values: Sequence[str | None],
    order: Iterable[str],
    groups: Mapping[str, str] | None = None,
) -> Filter:
    """Return a filter of episodes: the values that can be chosen, and the place of each episode's.

    Episodes with the outcomes success, error and success have, in the order success, failure,
    error, the values ``["success", "error"]`` and the column ``[0, 1, 0]``.

    Args:
        label: of the filter.
        values: of the episodes; None if one has no value.
        order: values that come first; others follow by name.
        groups: the heading above each value; None without headings.
    """
    occurring = {value for value in values if value is not None}
    choices = []
    for value in dict.fromkeys((*order, *sorted(occurring))):
        if value in occurring:
            choices.append(value)
    places = {value: place for place, value in enumerate(choices)}
    column = [_NO_VALUE if value is None else places[value] for value in values]
    headings = []
    if groups is not None:
        headings = [groups[value] for value in choices]
    return Filter(label, choices, column, headings)


def make_numbers(episodes: PageEpisodes) -> dict[str, Sequence[int | str]]:
    """Return the columns of the page's list of episodes that are no filters, such as its steps.

    Episodes of the same scene have the same number in the column ``scene``. Those that can be
    compared between policies, because seed, options and conditions are the same too, have the same
    number in the column ``pair``.
    """
    fairness = operator.attrgetter(*(trait.path for trait in FAIRNESS))
    scenes = []
    pairs = []
    columns: dict[str, list[int | str]] = {"key": [], "episode": [], "steps": []}
    for episode in episodes.all:
        record = episode.record
        columns["key"].append(episode.key)
        columns["episode"].append(record.episode)
        columns["steps"].append(record.steps)
        scene = (record.task, record.split, record.episode)
        scenes.append(scene)
        pairs.append((*scene, record.policy_seed, record.column, fairness(record)))
    return {**columns, "scene": _numbers(scenes), "pair": _numbers(pairs)}


def _numbers(keys: Iterable[tuple[object, ...]]) -> list[int]:
    """Return a number for each key, the same for equal ones, such as 0, 1, 0, 2."""
    numbers: dict[tuple[object, ...], int] = {}
    return [numbers.setdefault(key, len(numbers)) for key in keys]


def setting_label(options: InstructionOptions) -> str:
    """Return the label of options without the form, such as resolved, which is its own filter."""
    return options_label(replace(options, form="implicit"))


def _failure(record: Summary) -> str | None:
    """Return why an episode failed, such as ``wrong_object`` or ``timeout``; None for a success.

    Without a known cause, or if this version does not have its name, it is ``not attributed``.
    """
    if record.outcome == "success":
        return None
    if record.error:
        return record.error
    attribution = record.attribution
    if attribution is None or attribution.failure not in FAILURE_KINDS:
        return UNATTRIBUTED
    return attribution.failure
