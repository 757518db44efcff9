"""The data of the page: columns of small numbers, and a line of details for each episode.

A page of ten thousand episodes must open and filter at once. So filters use columns of indices,
every text is stored once, and the details of an episode are a line of JSON that is parsed when the
episode is opened.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, get_args

import msgspec

from roboirg.core.episode import DIFFICULTIES
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.page.details import Strings, details_of, searched_texts
from roboirg.evaluation.analysis.page.entries import EpisodeEntries, EpisodeEntry
from roboirg.evaluation.analysis.page.episode_videos import EpisodeVideo, EpisodeVideos
from roboirg.evaluation.analysis.page.reconstruction import resolved_form
from roboirg.evaluation.analysis.stats.cells import FAIRNESS, EvalConditions, task_order
from roboirg.evaluation.analysis.stats.failure_counts import UNATTRIBUTED
from roboirg.evaluation.analysis.stats.option_labels import options_label, options_sort_key
from roboirg.evaluation.records.record import ERROR_KINDS, FailureKind, Outcome, Record, Summary
from roboirg.judging.failure_attribution import EXECUTION, GROUNDING
from roboirg.tasks import all_tasks

NO_FAILURE = -1
ERROR = "error"

Row = dict[str, int | str]
Progress = Callable[[int, int], None]
"""Told after each episode: how many are done, and how many there are."""


class FilterOption(NamedTuple):
    """A filter: its name in the columns, its label, and its values.

    Attributes:
        groups: for each value the heading above it; empty without headings. No value occurs in
            two groups.
    """

    name: str
    label: str
    values: tuple[str, ...]
    groups: tuple[str, ...] = ()


@dataclass
class Columns:
    """The data that the page's script reads.

    Attributes:
        choices: the filters.
        columns: by name, a number for each episode; for a filter the index of its value.
        strings: every text, once.
        words: for each episode, the texts that a search looks through.
        details: for each episode, a line of JSON.
        videos: embedded in the page, by the episode's key.
    """

    choices: tuple[FilterOption, ...]
    columns: dict[str, list[int | str]] = field(default_factory=dict)
    strings: Strings = field(default_factory=Strings)
    words: list[list[int]] = field(default_factory=list)
    details: list[str] = field(default_factory=list)
    videos: dict[str, EpisodeVideo] = field(default_factory=dict)


def make_columns(
    entries: EpisodeEntries, videos: EpisodeVideos, progress: Progress | None = None
) -> Columns:
    """Make the data of all episodes, whose whole records are read one after the other."""
    found = Columns(_choices(entries))
    index = {
        choice.name: {value: number for number, value in enumerate(choice.values)}
        for choice in found.choices
    }
    numbers: dict[tuple[object, ...], int] = {}
    resolved = _ResolvedTexts(entries)
    for done, (entry, record) in enumerate(zip(entries.all, entries.whole(), strict=True), 1):
        row = _row(entry, entries, index, numbers)
        for name, value in row.items():
            found.columns.setdefault(name, []).append(value)
        video = videos.video(entry)
        if video is not None and videos.embeds:
            found.videos[entry.key] = video
        found.words.append(searched_texts(record, found.strings))
        text = resolved.of(entry, record)
        details = details_of(record, found.strings, video, text, embeds=videos.embeds)
        if (log := entry.log) is not None:
            details["log"] = log
        found.details.append(msgspec.json.encode(details).decode())
        if progress is not None:
            progress(done, len(entries.all))
    return found


def failure_of(entry: EpisodeEntry) -> tuple[str, str] | None:
    """Return kind and name of an episode's failure or error; None for a success."""
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
    options = sorted({entry.options for entry in entries.all}, key=options_sort_key)
    settings = tuple(dict.fromkeys(map(setting_label, options)))
    failures = _failures(entries.all)
    tasks = tuple(task_order({record.task for record in records}))
    return (
        FilterOption("policy", "policy", tuple(entries.names.values())),
        FilterOption("task", "task", tasks, tuple(map(_suite, tasks))),
        FilterOption("setting", "setting", settings),
        FilterOption("form", "form", tuple(dict.fromkeys(one.form for one in options))),
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
    numbers: dict[tuple[object, ...], int],
) -> Row:
    record = entry.record
    failure = failure_of(entry)
    scene = (record.task, record.split, record.episode)
    return {
        "key": entry.key,
        "policy": index["policy"][entries.names[entry.policy_run]],
        "task": index["task"][record.task],
        "setting": index["setting"][setting_label(entry.options)],
        "form": index["form"][entry.options.form],
        "difficulty": index["difficulty"][record.difficulty],
        "outcome": index["outcome"][record.outcome],
        "failure": NO_FAILURE if failure is None else index["failure"][failure[1]],
        "seed": index["seed"][str(record.policy_seed)],
        "episode": record.episode,
        "steps": record.steps,
        # Episodes of the same scene, and among them those that can be compared.
        "scene": numbers.setdefault(scene, len(numbers)),
        "pair": numbers.setdefault(
            (*scene, record.policy_seed, entry.options, _fairness(record)), len(numbers)
        ),
    }


def _fairness(record: Summary) -> tuple[object, ...]:
    """Return what two episodes must share to be compared, besides scene and instruction."""
    conditions = EvalConditions.of(record)
    return tuple(conditions.value(name) for name in FAIRNESS)


def setting_label(options: InstructionOptions) -> str:
    """Return the label of options whatever the form, which is a filter of its own."""
    return options_label(replace(options, form="implicit"))


def _instruction_key(entry: EpisodeEntry) -> tuple[object, ...]:
    record = entry.record
    return (
        record.task,
        record.split,
        record.episode,
        replace(record.options, form=""),
        record.language_version,
        record.environment_version,
    )


class _ResolvedTexts:
    """The resolved form of instructions: as it was played, else derived once for each."""

    def __init__(self, entries: EpisodeEntries) -> None:
        played = {
            _instruction_key(entry): entry
            for entry in entries.all
            if entry.options.form == "resolved"
        }
        self._played = {
            key: " ".join(turn.text for turn in record.instruction)
            for key, entry in played.items()
            for record in entry.run.whole([entry.record])
        }
        self._derived: dict[tuple[object, ...], str | None] = {}

    def of(self, entry: EpisodeEntry, record: Record) -> str | None:
        """Return the resolved form of an episode's instruction, or None."""
        if record.form == "resolved":
            return None
        key = _instruction_key(entry)
        if key in self._played:
            return self._played[key]
        own = (*key, record.wordings_file)
        if own not in self._derived:
            self._derived[own] = resolved_form(record)
        return self._derived[own]
