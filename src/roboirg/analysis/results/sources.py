"""Stored runs, plans with records: folders, packs, or some policies of these."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple, TypeVar

from roboirg.analysis.results.frame import Frame, Spared, make_frame
from roboirg.core.errors import InvalidValueError, check_names
from roboirg.records.packs import PACK_SUFFIX, opened_run
from roboirg.records.record import Job, Record, Summary
from roboirg.records.record_codec import read_summary
from roboirg.records.run_files import run_folder
from roboirg.records.store import StoredRun, iterate_records
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.stopping import Stopping, find_stopping
from roboirg.runs.plan.stored_plans import read_plan, read_plans
from roboirg.util.freed_memory import paused_collection


class FrameParts(NamedTuple):
    """What of a run its frame is made of.

    Attributes:
        results: those that count.
        planned: jobs that should have a result.
        spared: what a run needs no more that stops when it is decided; None for other runs.
    """

    results: Sequence[Summary]
    planned: Sequence[Job]
    spared: Spared | None

    def spared_of(self, name: str) -> Mapping[str, Spared]:
        """Return what is spared by the name of the run, as `make_frame` takes it."""
        return {} if self.spared is None else {name: self.spared}


AnyJob = TypeVar("AnyJob", bound=Job)

_UNKNOWN_FINDING = (
    "what was found cannot be told here: the run was merged with others, or its scenes are private "
    "and their salt is not known."
)


@dataclass(frozen=True)
class Source:
    """An opened run, or some of its policies.

    Attributes:
        path: of the folder or the pack, as it was given.
        unpacked: folder with the files of a pack; None if `path` is one.
        policies: those that are wanted; None for all.
    """

    path: Path
    unpacked: Path | None = None
    policies: tuple[str, ...] | None = None

    @property
    def folder(self) -> Path:
        """The folder with the files."""
        return self.unpacked or self.path

    @property
    def name(self) -> str:
        """The name of the folder or the pack, with the wanted policies: ``first:listener``."""
        name = self.path.resolve().name.removesuffix(PACK_SUFFIX)
        if self.policies is None:
            return name
        return ":".join((name, *self.policies))

    @cached_property
    def stored(self) -> StoredRun[Summary]:
        """The newest result of each episode, and where its whole record is.

        Raises:
            StoreError: there are none, or a line is not a record of this schema version.
        """
        with paused_collection():
            return StoredRun(self.folder, read_summary)

    @cached_property
    def results(self) -> tuple[Summary, ...]:
        """The newest result of each episode, in the order of the file; only of wanted policies.

        Raises:
            StoreError: there are none, or a line is not a record of this schema version.
            UnknownNameError: a policy that is wanted is neither among them nor planned.
        """
        newest = self.stored.newest
        if self.policies is None:
            return newest
        known = list(dict.fromkeys(job.policy for job in (*self.planned, *newest)))
        check_names(f"policy in {self.path}", self.policies, known)
        return tuple(self.wanted(newest))

    @cached_property
    def _plan(self) -> Plan | None:
        """The newest plan; None if it is not known."""
        return read_plan(self.folder)

    @cached_property
    def _jobs(self) -> tuple[Job, ...]:
        """The jobs of the newest plan; none if the plan or its episodes are not known."""
        if self._plan is None:
            return ()
        return self._plan.drawable_jobs(self.stored.newest)

    @cached_property
    def planned(self) -> tuple[Job, ...]:
        """The jobs of the newest plan, of wanted policies; none if it is not known."""
        return tuple(self.wanted(self._jobs))

    @cached_property
    def stopping(self) -> Stopping | None:
        """What a run that stops when it is decided has found; None for other runs."""
        plan = self._plan
        if plan is None or plan.stop is None or not self._jobs:
            return None
        return find_stopping(plan, self._jobs, self.stored.newest)

    @cached_property
    def frame_parts(self) -> FrameParts:
        """What the frame of the run is made of."""
        stopping = self.stopping
        if stopping is None:
            # A merged run has no plan of its own, but those of its parts.
            plans = read_plans(self.folder) if self._plan is None else (self._plan,)
            spared = None
            if any(plan.stop is not None for plan in plans):
                spared = Spared((_UNKNOWN_FINDING,), ())
            return FrameParts(self.results, self.planned, spared)
        results = list(filter(stopping.needs, self.results))
        planned: list[Job] = []
        unneeded: list[Job] = []
        compared = list(self.planned)
        for side, scenes in stopping.trials.items():
            if side.policy == stopping.rule.against:  # not planned, as it is stored already
                for jobs_of_scene in scenes.values():
                    compared += self.wanted(jobs_of_scene)
        for job in compared:
            jobs = planned if stopping.needs(job) else unneeded
            jobs.append(job)
        findings = tuple(compared.sentence for compared in stopping.compared)
        return FrameParts(results, planned, Spared(findings, unneeded))

    @cached_property
    def frame(self) -> Frame:
        """The results as a table, with a row for each planned job without one, too."""
        parts = self.frame_parts
        name = str(self.path)
        return make_frame([(name, parts.results)], parts.planned, spared=parts.spared_of(name))

    def records(self) -> Iterator[Record]:
        """Yield the whole records; those that were written again come twice."""
        return iter(self.wanted(iterate_records(self.folder)))

    def wanted(self, jobs: Iterable[AnyJob]) -> Iterable[AnyJob]:
        """Return the jobs of the policies that are wanted."""
        if self.policies is None:
            return jobs
        return (job for job in jobs if job.policy in self.policies)


@contextlib.contextmanager
def opened_sources(
    paths: Iterable[str | Path], folders: Collection[str] = ()
) -> Iterator[list[Source]]:
    """Open the folders and packed files of runs, each once even if it is named several times.

    A pack is unpacked into a temporary folder until the block ends.

    Args:
        paths: of folders and packs; ``PATH:policy`` for one policy, whose name may contain colons.
        folders: what is unpacked of packs in addition to records and plans, as in `opened_run`.

    Raises:
        StoreError: there is no such path, or the file is no pack.
    """
    wanted: dict[Path, Source] = {}
    for text in paths:
        source = _parsed(str(text))
        place = source.path.resolve()
        if place in wanted:
            source = _joined(wanted[place], source)
        wanted[place] = source
    with contextlib.ExitStack() as stack:
        opened = []
        for source in wanted.values():
            folder = stack.enter_context(opened_run(source.path, folders))
            is_pack = folder != source.path
            opened.append(replace(source, unpacked=folder) if is_pack else source)
        yield opened


def _parsed(text: str) -> Source:
    """Return the run that a text names: ``runs/first``, or one policy of it: ``runs/first:pi0``."""
    run_folder(text)  # refuses what can be no path
    path = text
    # A path may contain colons, too: the longest one that exists is meant.
    while ":" in path and not Path(path).exists():
        path, _, _ = path.rpartition(":")
    if path == text:
        return Source(Path(path))
    policy = text[len(path) + 1 :]
    if not policy:
        raise InvalidValueError(f"The name of the policy after {text!r} is empty.")
    return Source(Path(path), policies=(policy,))


def _joined(first: Source, second: Source) -> Source:
    """Return one run with the policies that either of two wants of it."""
    if first.policies is None or second.policies is None:
        return replace(first, policies=None)
    policies = dict.fromkeys((*first.policies, *second.policies))
    return replace(first, policies=tuple(policies))
