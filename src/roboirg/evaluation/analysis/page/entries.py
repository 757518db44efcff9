"""The episodes of a page in order, each with its policy run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from urllib.parse import quote

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.stats.cells import (
    CellKey,
    CellResults,
    Cells,
    PolicyRun,
    gather,
    labels,
    policy_order,
    sort_cells,
    task_order,
)
from roboirg.evaluation.analysis.stats.option_labels import options_sort_key
from roboirg.evaluation.records.episode_log import log_path
from roboirg.evaluation.records.record import Job, Record, Summary
from roboirg.evaluation.records.store import StoredRun


@dataclass(frozen=True, slots=True)
class Run:
    """A run that a page shows.

    Attributes:
        name: of the run.
        records: one for each identity; the whole records unless they are in `stored`.
        folder: of its videos; None leaves them out.
        planned: jobs that should have a record.
        link: prefix of the paths of videos that are not in the page.
        stored: holds the whole records; None if `records` are whole.
        logs: slugs of the episodes that have a log.
    """

    name: str
    records: Sequence[Summary]
    folder: Path | None = None
    planned: Sequence[Job] = ()
    link: str = ""
    stored: StoredRun[Summary] | None = None
    logs: frozenset[str] = frozenset()

    def whole(self, records: Iterable[Summary]) -> Iterator[Record]:
        """Yield the whole records of some of its records, each read when it is asked for."""
        if self.stored is None:
            return (one for one in records if isinstance(one, Record))
        return self.stored.records(records)


@dataclass(frozen=True, slots=True)
class EpisodeEntry:
    """One episode of the page.

    Attributes:
        key: short, unique on the page, the same in every page about the run.
        record: of the episode, or a part of it.
        policy_run: that played it.
        run: that it belongs to.
    """

    key: str
    record: Summary
    policy_run: PolicyRun
    run: Run

    @property
    def options(self) -> InstructionOptions:
        return self.record.column

    @property
    def log(self) -> str | None:
        """Address of the episode's log, as seen from the page; None without one."""
        if not self.run.logs or (slug := self.record.slug) not in self.run.logs:
            return None
        return quote(f"{self.run.link}{log_path(Path(), slug).as_posix()}")


@dataclass(frozen=True, slots=True)
class EpisodeEntries:
    """All episodes and their cells.

    Attributes:
        all: by policy run, task, episode, options and policy seed.
        cells: the same results gathered, with those that are missing.
        names: labels of the policy runs, in the order of the page.
    """

    all: tuple[EpisodeEntry, ...]
    cells: Cells
    names: Mapping[PolicyRun, str]

    def whole(self) -> Iterator[Record]:
        """Yield the whole records of all episodes in order, each read when it is asked for."""
        for _, entries in groupby(self.all, key=lambda entry: id(entry.run)):
            own = list(entries)
            yield from own[0].run.whole(entry.record for entry in own)


def make_entries(runs: Sequence[Run]) -> EpisodeEntries:
    """Sort the episodes of one run, or of two runs to compare."""
    found: dict[CellKey, CellResults] = {}
    entries: list[EpisodeEntry] = []
    for number, run in enumerate(runs):
        name = run.name if len(runs) > 1 else ""
        found |= gather_run(name, run.records, run.planned)
        for record in run.records:
            key = record.slug.rpartition("-")[2] + ("" if number == 0 else f"-{number + 1}")
            entries.append(EpisodeEntry(key, record, PolicyRun.of(record, name), run))
    policies = list(
        dict.fromkeys(job.policy for run in runs for job in (*run.planned, *run.records))
    )
    cells = sort_cells(found, policy_order(found, policies, [run.name for run in runs]))
    names = labels(cells)
    return EpisodeEntries(_sorted(entries, list(names)), cells, names)


def gather_run(name: str, records: Sequence[Summary], planned: Sequence[Job] = ()) -> Cells:
    """Gather the records of one run; its policy runs bear the given name."""
    return {
        key._replace(policy_run=key.policy_run._replace(run=name)): cell
        for key, cell in gather([(name, records)], planned).items()
    }


def _sorted(
    entries: Sequence[EpisodeEntry], policy_runs: Sequence[PolicyRun]
) -> tuple[EpisodeEntry, ...]:
    ranks = {policy_run: rank for rank, policy_run in enumerate(policy_runs)}
    tasks = task_order({entry.record.task for entry in entries})
    return tuple(
        sorted(
            entries,
            key=lambda one: (
                ranks[one.policy_run],
                tasks.index(one.record.task),
                one.record.episode,
                options_sort_key(one.options),
                one.record.policy_seed,
            ),
        )
    )
