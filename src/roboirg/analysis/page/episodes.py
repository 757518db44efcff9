"""The episodes of a page in order, and their cells."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.frame import Frame, RunNames, join, make_frame
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.analysis.results.sources import Source
from roboirg.records.episode_log import log_path, logged_slugs
from roboirg.records.film import poster_name
from roboirg.records.record import Record, Summary
from roboirg.records.run_files import run_file

SourceByName = Mapping[str, Source]
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

    runs: SourceByName
    data: RunData
    all: tuple[PageEpisode, ...]

    @classmethod
    def of(cls, runs: SourceByName, *, videos: bool) -> PageEpisodes:
        """Gather the episodes of the page's runs, sorted by policy, task and number.

        Args:
            runs: by name, one or two.
            videos: whether to look for the episodes' videos.
        """
        frames = []
        for name, source in _named(runs):
            if name:
                parts = source.frame_parts
                spared = parts.spared_of(name)
                frames.append(
                    make_frame([(name, parts.results)], parts.planned, run_name=name, spared=spared)
                )
            else:
                frames.append(source.frame)
        frame = join(frames)
        return cls(runs, RunData(frame), tuple(_episodes(runs, frame, videos=videos)))

    @property
    def names(self) -> RunNames:
        """Labels of the policy runs, in the order of the page."""
        return self.data.frame.names

    @property
    def records(self) -> list[Summary]:
        """The records of all episodes in order, without instructions and events."""
        return [episode.record for episode in self.all]

    def whole(self) -> Iterator[Record]:
        """Yield the whole records of all episodes in order, each read when it is asked for."""
        for name, run in _named(self.runs):
            results = [episode.record for episode in self.all if episode.policy_run.run == name]
            yield from run.stored.records(results)


def _named(runs: SourceByName) -> Iterator[tuple[str, Source]]:
    """Yield each run with the name that its policy runs bear; a single run has an empty one."""
    has_several_runs = len(runs) > 1
    for name, run in runs.items():
        yield name if has_several_runs else "", run


def _episodes(runs: SourceByName, frame: Frame, *, videos: bool) -> Iterator[PageEpisode]:
    """Yield the episodes that were played, each with its video and log file if these exist.

    Args:
        runs: the runs by name.
        frame: their results.
        videos: whether to look for videos.
    """
    sources = dict(_named(runs))
    names = list(sources)
    logs = {name: logged_slugs(source.folder) for name, source in sources.items()}
    for policy_run, record in _played_by_scene(frame):
        folder = sources[policy_run.run].folder
        key = _page_key(record.slug, names.index(policy_run.run))
        film = None
        if videos:
            film = _existing(folder, record.video)
        poster = None
        if film is not None:
            poster = _existing(folder, poster_name(str(record.video)))
        log = None
        if record.slug in logs[policy_run.run]:
            log = log_path(folder, record.slug)
        yield PageEpisode(key, record, policy_run, film, poster, log)


def _page_key(slug: str, run: int) -> str:
    """Return what identifies an episode in the page: ``4f2a``, or ``4f2a-2`` of the second run.

    Args:
        slug: of its record; the last part is a hash of all that identifies it in its run.
        run: number of the run, from 0; both may have the same episode.
    """
    key = slug.rpartition("-")[2]
    return f"{key}-{run + 1}" if run > 0 else key


def _played_by_scene(frame: Frame) -> Iterator[tuple[PolicyRun, Summary]]:
    """Yield policy run and result of each episode that was played, sorted by its number in a task.

    So the episodes of the same scene, in several settings, follow one another. Policy runs, and the
    tasks of each, stay in the order of the frame.
    """
    groups = defaultdict(list)
    for policy_run, result in zip(frame["run"], frame["result"], strict=True):
        if isinstance(result, Summary):
            groups[policy_run, result.task].append(result)
    for (policy_run, _), results in groups.items():
        for result in sorted(results, key=lambda result: result.episode):
            yield policy_run, result


def _existing(folder: Path, name: str | None) -> Path | None:
    """Return a file of a run; None without a name, or if there is no such file."""
    if name is None:
        return None
    path = run_file(folder, name)
    return path if path.is_file() else None
