"""Stored runs, plans with records: folders, packs, or some policies of these."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeVar

from roboirg.core.errors import InvalidValueError, check_names
from roboirg.evaluation.plan.stored_plans import read_plan
from roboirg.evaluation.records.packs import PACK_SUFFIX, opened_run
from roboirg.evaluation.records.record import Job, Record, Summary
from roboirg.evaluation.records.record_codec import read_summary
from roboirg.evaluation.records.run_files import run_folder
from roboirg.evaluation.records.store import StoredRun, iterate_records
from roboirg.util.freed_memory import paused_collection

AnyJob = TypeVar("AnyJob", bound=Job)


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
        """The name of the folder or the pack, with those of the wanted policies."""
        name = self.path.resolve().name.removesuffix(PACK_SUFFIX)
        return ":".join((name, *(self.policies or ())))

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
        """The newest result of each episode, in the order of the file.

        Raises:
            StoreError: there are none, or a line is not a record of this schema version.
            UnknownNameError: a policy that is wanted is neither among them nor planned.
        """
        found = self.stored.newest
        if self.policies is None:
            return found
        known = list(dict.fromkeys(one.policy for one in (*self.planned, *found)))
        check_names(f"policy in {self.path}", self.policies, known)
        return tuple(self.wanted(found))

    @cached_property
    def planned(self) -> tuple[Job, ...]:
        """The jobs of the newest plan; none if the plan or its episodes are not known."""
        plan = read_plan(self.folder)
        jobs = () if plan is None else plan.drawable_jobs(self.stored.newest)
        return tuple(self.wanted(jobs))

    def records(self) -> Iterator[Record]:
        """Yield the whole records; those that were written again come twice."""
        return iter(self.wanted(iterate_records(self.folder)))

    def wanted(self, jobs: Iterable[AnyJob]) -> Iterable[AnyJob]:
        """Return the jobs of the policies that are wanted."""
        if self.policies is None:
            return jobs
        return (one for one in jobs if one.policy in self.policies)


@contextlib.contextmanager
def opened_sources(
    paths: Iterable[str | Path], folders: Collection[str] = ()
) -> Iterator[list[Source]]:
    """Open folders and packs, each once, even if several of its policies are named.

    Args:
        paths: of folders and packs; ``PATH:policy`` for one policy, whose name may contain colons.
        folders: what is unpacked of packs in addition to records and plans, as in `opened_run`.

    Raises:
        StoreError: there is no such path, or the file is no pack.
    """
    named: dict[Path, tuple[Path, list[str | None]]] = {}
    for path, policy in map(_split, map(str, paths)):
        named.setdefault(path.resolve(), (path, []))[1].append(policy)
    with contextlib.ExitStack() as stack:
        found = []
        for path, policies in named.values():
            folder = stack.enter_context(opened_run(path, folders))
            wanted = None if None in policies else tuple(dict.fromkeys(filter(None, policies)))
            found.append(Source(path, None if folder == path else folder, wanted))
        yield found


def _split(text: str) -> tuple[Path, str | None]:
    """Return the path of a run, and the policy that follows it after a colon."""
    run_folder(text)
    path = text
    while ":" in path and not Path(path).exists():
        path = path.rpartition(":")[0]
    policy = text[len(path) + 1 :]
    if path != text and not policy:
        raise InvalidValueError(f"The name of the policy after {text!r} is empty.")
    return Path(path), policy or None
