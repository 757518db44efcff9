"""The episodes as the page carries them: columns of small numbers, and a line of details for each.

Ten thousand episodes have to open and filter at once. So what is filtered by is kept as columns of
indices, every text is kept once, and what only an opened episode shows is a line of JSON that
nobody parses before.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, get_args

from roboirg.analysis.page.details import Strings, details_of, words_of
from roboirg.analysis.page.entries import EpisodeEntries, EpisodeEntry, task_order
from roboirg.analysis.page.films import EpisodeVideo, EpisodeVideos
from roboirg.analysis.stats.success_rates import SettingColumn
from roboirg.core.episode import DIFFICULTIES
from roboirg.judging.failure_attribution import EXECUTION, GROUNDING
from roboirg.records.record import ERROR_KINDS, FailureKind, Outcome
from roboirg.tasks import all_tasks

NO_FAILURE = -1
UNATTRIBUTED = "not attributed"
ERROR = "error"

Row = dict[str, int | str]


class FilterOption(NamedTuple):
    """A filter: its name in the columns, what it is called, and what it offers.

    Attributes:
        groups: for each value the heading above it; empty without headings. Values of all groups
            differ.
    """

    name: str
    label: str
    values: tuple[str, ...]
    groups: tuple[str, ...] = ()


@dataclass
class Columns:
    """What the page's script reads.

    Attributes:
        choices: the filters.
        columns: by name, a number for each episode; of a filter the index of its value.
        strings: every text once.
        words: for each episode, the texts that a search looks into.
        details: for each episode, a line of JSON.
        films: that are part of the page, by the episode's key.
    """

    choices: tuple[FilterOption, ...]
    columns: dict[str, list[int | str]] = field(default_factory=dict)
    strings: Strings = field(default_factory=Strings)
    words: list[list[int]] = field(default_factory=list)
    details: list[str] = field(default_factory=list)
    films: dict[str, EpisodeVideo] = field(default_factory=dict)


def make_columns(entries: EpisodeEntries, films: EpisodeVideos) -> Columns:
    """Take the episodes apart."""
    found = Columns(_choices(entries))
    index = {
        choice.name: {value: number for number, value in enumerate(choice.values)}
        for choice in found.choices
    }
    same: dict[tuple[object, ...], int] = {}
    resolved = _resolved_texts(entries.all)
    for entry in entries.all:
        row = _row(entry, entries, index, same)
        for name, value in row.items():
            found.columns.setdefault(name, []).append(value)
        film = films.film(entry)
        if film is not None and films.embeds:
            found.films[entry.key] = film
        found.words.append(words_of(entry.record, found.strings))
        text = resolved.get(_scene_and_words(entry))
        details = details_of(entry.record, found.strings, film, text, embeds=films.embeds)
        found.details.append(json.dumps(details, separators=(",", ":")))
    return found


def failure_of(entry: EpisodeEntry) -> tuple[str, str] | None:
    """Of what kind an episode's failure or error is, and which; None for a success."""
    record = entry.record
    if record.outcome == "success":
        return None
    if record.outcome == "error":
        return ERROR, record.error or UNATTRIBUTED
    if record.attribution is None:
        return UNATTRIBUTED, UNATTRIBUTED
    return record.attribution.kind, record.attribution.failure


def _choices(entries: EpisodeEntries) -> tuple[FilterOption, ...]:
    records = [entry.record for entry in entries.all]
    told = sorted({entry.told for entry in entries.all}, key=SettingColumn.sort_key)
    settings = tuple(dict.fromkeys(one._replace(form="implicit").label for one in told))
    failures = _failures(entries.all)
    tasks = tuple(task_order({record.task for record in records}))
    return (
        FilterOption("policy", "policy", tuple(entries.names.values())),
        FilterOption("task", "task", tasks, tuple(map(_suite, tasks))),
        FilterOption("setting", "setting", settings),
        FilterOption("form", "form", tuple(dict.fromkeys(one.form for one in told))),
        FilterOption(
            "difficulty", "difficulty", _present(DIFFICULTIES, (r.difficulty for r in records))
        ),
        FilterOption(
            "outcome", "outcome", _present(get_args(Outcome), (r.outcome for r in records))
        ),
        FilterOption(
            "failure",
            "why it failed",
            tuple(name for _, name in failures),
            tuple(kind for kind, _ in failures),
        ),
        FilterOption(
            "seed", "policy seed", tuple(map(str, sorted({r.policy_seed for r in records})))
        ),
    )


def _suite(task: str) -> str:
    known = all_tasks().get(task)
    return known.suite if known else "other tasks"


def _failures(entries: Iterable[EpisodeEntry]) -> list[tuple[str, str]]:
    grounding, execution = get_args(FailureKind)
    order = [
        *((grounding, name) for name in GROUNDING),
        *((execution, name) for name in EXECUTION),
        (UNATTRIBUTED, UNATTRIBUTED),
        *((ERROR, name) for name in ERROR_KINDS),
    ]
    found = {failure for entry in entries if (failure := failure_of(entry)) is not None}
    return [*(one for one in order if one in found), *sorted(found - set(order))]


def _present(order: Sequence[str], values: Iterable[str]) -> tuple[str, ...]:
    found = set(values)
    return (*(one for one in order if one in found), *sorted(found - set(order)))


def _row(
    entry: EpisodeEntry,
    entries: EpisodeEntries,
    index: dict[str, dict[str, int]],
    same: dict[tuple[object, ...], int],
) -> Row:
    record = entry.record
    failure = failure_of(entry)
    scene = (record.task, record.split, record.episode)
    return {
        "key": entry.key,
        "policy": index["policy"][entries.names[entry.who]],
        "task": index["task"][record.task],
        "setting": index["setting"][entry.told._replace(form="implicit").label],
        "form": index["form"][entry.told.form],
        "difficulty": index["difficulty"][record.difficulty],
        "outcome": index["outcome"][record.outcome],
        "failure": NO_FAILURE if failure is None else index["failure"][failure[1]],
        "seed": index["seed"][str(record.policy_seed)],
        "episode": record.episode,
        "steps": record.steps,
        # Episodes of the same scene, and among them those that can be held against each other.
        "scene": same.setdefault(scene, len(same)),
        "pair": same.setdefault((*scene, record.policy_seed, entry.told), len(same)),
    }


def _scene_and_words(entry: EpisodeEntry) -> tuple[object, ...]:
    record = entry.record
    return (
        record.task,
        record.split,
        record.episode,
        entry.told._replace(form=""),
        record.language_version,
        record.environment_version,
    )


def _resolved_texts(entries: Iterable[EpisodeEntry]) -> dict[tuple[object, ...], str]:
    """What was said in the resolved form, where that was played."""
    return {
        _scene_and_words(entry): " ".join(turn.text for turn in entry.record.instruction)
        for entry in entries
        if entry.told.form == "resolved"
    }
