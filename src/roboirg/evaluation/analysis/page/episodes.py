"""The episodes of a page in order, and their cells."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

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
from roboirg.evaluation.plan.sources import Source
from roboirg.evaluation.records.episode_log import log_path, logged_slugs
from roboirg.evaluation.records.film import poster_name
from roboirg.evaluation.records.record import Record, Summary
from roboirg.evaluation.records.run_files import run_file

Runs = Mapping[str, Source]
"""The runs that a page shows by their names: one, or two to compare."""


class PageEpisode(NamedTuple):
    """One episode of the page.

    Attributes:
        key: short, unique on the page, the same in every page about the run.
        record: of the episode, without instruction and events.
        options: of its instruction, without whose words they are.
        policy_run: that played it.
        film: its video, which is there; None without one.
        poster: the last frame of the video.
        log: what was printed; None without a log.
    """

    key: str
    record: Summary
    options: InstructionOptions
    policy_run: PolicyRun
    film: Path | None
    poster: Path | None
    log: Path | None


@dataclass(frozen=True, slots=True)
class PageEpisodes:
    """All episodes of a page and their cells.

    Attributes:
        runs: that the page shows.
        all: by policy run, task, episode, options and policy seed.
        cells: the same results gathered, with those that are missing.
        names: labels of the policy runs, in the order of the page.
    """

    runs: Runs
    all: tuple[PageEpisode, ...]
    cells: Cells
    names: Mapping[PolicyRun, str]

    @classmethod
    def of(cls, runs: Runs, *, videos: bool) -> PageEpisodes:
        """Gather and sort the episodes, with or without their videos."""
        found = _gather(runs)
        jobs = (job for run in runs.values() for job in (*run.planned, *run.results))
        policies = list(dict.fromkeys(job.policy for job in jobs))
        cells = sort_cells(found, policy_order(found, policies, list(runs)))
        names = labels(cells)
        episodes = _sorted(_episodes(runs, videos=videos), list(names))
        return cls(runs, episodes, cells, names)

    def cells_of(self, difficulty: str) -> Cells:
        """Gather the episodes of one difficulty; missing ones have none yet."""
        return sort_cells(_gather(self.runs, difficulty), list(self.names))

    def whole(self) -> Iterator[Record]:
        """Yield the whole records of all episodes in order, each read when it is asked for."""
        for name, run in _named(self.runs):
            own = [one.record for one in self.all if one.policy_run.run == name]
            yield from run.stored.records(own)


def _named(runs: Runs) -> Iterator[tuple[str, Source]]:
    """Yield each run after the name that its policy runs bear; a single run needs none."""
    for name, run in runs.items():
        yield name if len(runs) > 1 else "", run


def _gather(runs: Runs, difficulty: str | None = None) -> Cells:
    """Gather all results with missing ones, or those of one difficulty; two runs stay apart."""
    found: dict[CellKey, CellResults] = {}
    for name, run in _named(runs):
        results = [one for one in run.results if difficulty in (None, one.difficulty)]
        own = gather([(name, results)], run.planned if difficulty is None else ())
        found |= {
            key._replace(policy_run=key.policy_run._replace(run=name)): cell
            for key, cell in own.items()
        }
    return found


def _episodes(runs: Runs, *, videos: bool) -> Iterator[PageEpisode]:
    for number, (name, run) in enumerate(_named(runs)):
        logs = logged_slugs(run.folder)
        for record in run.results:
            slug, film, poster = record.slug, None, None
            if videos and record.video is not None:
                film = _existing(run.folder, record.video)
                poster = film and _existing(run.folder, poster_name(record.video))
            yield PageEpisode(
                key=slug.rpartition("-")[2] + ("" if number == 0 else f"-{number + 1}"),
                record=record,
                options=record.column,
                policy_run=PolicyRun.of(record, name),
                film=film,
                poster=poster,
                log=log_path(run.folder, slug) if slug in logs else None,
            )


def _existing(folder: Path, name: str) -> Path | None:
    path = run_file(folder, name)
    return path if path.is_file() else None


def _sorted(
    episodes: Iterator[PageEpisode], policy_runs: Sequence[PolicyRun]
) -> tuple[PageEpisode, ...]:
    found = list(episodes)
    runs = {policy_run: rank for rank, policy_run in enumerate(policy_runs)}
    tasks = {task: rank for rank, task in enumerate(task_order({e.record.task for e in found}))}
    options = {one: options_sort_key(one) for one in {episode.options for episode in found}}
    return tuple(
        sorted(
            found,
            key=lambda one: (
                runs[one.policy_run],
                tasks[one.record.task],
                one.record.episode,
                options[one.options],
                one.record.policy_seed,
            ),
        )
    )
