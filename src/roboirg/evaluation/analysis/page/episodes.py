"""The episodes of a page in order, and their cells."""

from __future__ import annotations

import operator
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from roboirg.evaluation.analysis.results.frame import Frame, RunNames, join, make_frame
from roboirg.evaluation.analysis.results.policy_run import PolicyRun
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.plan.sources import Source
from roboirg.evaluation.records.episode_log import log_path, logged_slugs
from roboirg.evaluation.records.film import poster_name
from roboirg.evaluation.records.record import Record, Summary
from roboirg.evaluation.records.run_files import run_file

Runs = Mapping[str, Source]
"""The runs that a page shows by their names: one, or two to compare."""


JsonObject = dict[str, Any]
"""What the page's script reads."""


class PageEpisode(NamedTuple):
    """One episode of the page.

    Attributes:
        key: short, unique on the page, the same in every page about the run.
        record: of the episode, without instruction and events.
        policy_run: that played it.
        film: its video, which is there; None without one.
        poster: the last frame of the video.
        log: what was printed; None without a log.
    """

    key: str
    record: Summary
    policy_run: PolicyRun
    film: Path | None
    poster: Path | None
    log: Path | None


@dataclass(frozen=True)
class PageEpisodes:
    """All episodes of a page and their results.

    Attributes:
        runs: that the page shows.
        data: the results of all runs, with those that are missing.
        all: by policy run, task, episode, options and policy seed.
    """

    runs: Runs
    data: RunData
    all: tuple[PageEpisode, ...]

    @classmethod
    def of(cls, runs: Runs, *, videos: bool) -> PageEpisodes:
        """Gather and sort the episodes, with or without their videos."""
        frame = join(
            make_frame([(name, run.results)], run.planned, named=name) for name, run in _named(runs)
        )
        return cls(runs, RunData(frame), tuple(_episodes(runs, frame, videos=videos)))

    @property
    def names(self) -> RunNames:
        """Labels of the policy runs, in the order of the page."""
        return self.data.frame.names

    def whole(self) -> Iterator[Record]:
        """Yield the whole records of all episodes in order, each read when it is asked for."""
        for name, run in _named(self.runs):
            own = [one.record for one in self.all if one.policy_run.run == name]
            yield from run.stored.records(own)


def _named(runs: Runs) -> Iterator[tuple[str, Source]]:
    """Yield each run after the name that its policy runs bear; a single run needs none."""
    for name, run in runs.items():
        yield name if len(runs) > 1 else "", run


def _episodes(runs: Runs, frame: Frame, *, videos: bool) -> Iterator[PageEpisode]:
    """Yield the episodes of a frame that were played, those of a scene one after the other."""
    named = dict(_named(runs))
    logs = {name: logged_slugs(run.folder) for name, run in named.items()}
    places: dict[object, int] = {}
    rows = [
        (places.setdefault((owner, one.task), len(places)), one.episode, owner, one)
        for owner, one in zip(frame["run"], frame["result"], strict=True)
        if isinstance(one, Summary)
    ]
    for _, _, owner, record in sorted(rows, key=operator.itemgetter(0, 1)):
        folder = named[owner.run].folder
        number = [*named].index(owner.run)
        slug = record.slug
        film = None
        poster = None
        if videos and record.video is not None:
            film = _existing(folder, record.video)
            poster = film and _existing(folder, poster_name(record.video))
        yield PageEpisode(
            key=slug.rpartition("-")[2] + (f"-{number + 1}" if number else ""),
            record=record,
            policy_run=owner,
            film=film,
            poster=poster,
            log=log_path(folder, slug) if slug in logs[owner.run] else None,
        )


def _existing(folder: Path, name: str) -> Path | None:
    path = run_file(folder, name)
    return path if path.is_file() else None
