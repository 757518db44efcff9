"""The episodes of a page in their order, each with who played it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from roboirg.analysis.stats.samples import (
    CellResults,
    EvalConditions,
    PolicyRun,
    Samples,
    Versions,
    gather,
    labels,
)
from roboirg.analysis.stats.success_rates import SettingColumn
from roboirg.records.record import Job, Record
from roboirg.tasks import all_tasks


@dataclass(frozen=True, slots=True)
class Run:
    """What a page is about, or is compared with.

    Attributes:
        name: of the run.
        records: one for each identity.
        folder: where its films are; None leaves them out.
        planned: jobs that should be there.
        link: what the page writes before the path of a film that is not in it.
    """

    name: str
    records: Sequence[Record]
    folder: Path | None = None
    planned: Sequence[Job] = ()
    link: str = ""


@dataclass(frozen=True, slots=True)
class EpisodeEntry:
    """One episode of the page.

    Attributes:
        key: short, unique on the page, the same in every page about the run.
        record: what is known.
        who: played it.
        told: in which way.
        run: to which it belongs.
    """

    key: str
    record: Record
    who: PolicyRun
    told: SettingColumn
    run: Run


@dataclass(frozen=True, slots=True)
class EpisodeEntries:
    """All episodes, and the samples they make.

    Attributes:
        all: by policy, task and episode, then as they are told.
        samples: with what is missing.
        names: of the contestants, in the order of the page.
    """

    all: tuple[EpisodeEntry, ...]
    samples: Samples
    names: Mapping[PolicyRun, str]


def make_entries(runs: Sequence[Run]) -> EpisodeEntries:
    """Sort the episodes of one run, or of two that are to be compared."""
    apart = len(runs) > 1
    samples: dict[tuple[PolicyRun, str, SettingColumn], CellResults] = {}
    entries: list[EpisodeEntry] = []
    for number, run in enumerate(runs):
        name = run.name if apart else ""
        for (who, task, told), sample in gather([(name, run.records)], run.planned).items():
            samples[who._replace(run=name), task, told] = sample
        for record in run.records:
            who = PolicyRun(record.policy, EvalConditions.of(record), Versions.of(record), name)
            key = record.slug.rpartition("-")[2] + ("" if number == 0 else f"-{number + 1}")
            entries.append(EpisodeEntry(key, record, who, SettingColumn.of(record), run))
    return _sorted(entries, samples, runs)


def _sorted(
    entries: Sequence[EpisodeEntry], samples: Samples, runs: Sequence[Run]
) -> EpisodeEntries:
    policies, privileged = _planned_order(runs), _privileged(entries)
    order = [run.name for run in runs]

    def place(who: PolicyRun) -> tuple[object, ...]:
        run = order.index(who.run) if who.run else 0
        return (run, policies.index(who.policy), repr(who.rules), repr(who.versions))

    names = labels(samples)
    marked = {
        who: f"{names[who]} (privileged)" if who.policy in privileged else names[who]
        for who in sorted(names, key=place)
    }
    ranks = {who: rank for rank, who in enumerate(marked)}
    tasks = task_order({task for _, task, _ in samples})
    ordered = sorted(
        entries,
        key=lambda one: (
            ranks[one.who],
            tasks.index(one.record.task),
            one.record.episode,
            one.told.sort_key(),
            one.record.policy_seed,
        ),
    )
    return EpisodeEntries(tuple(ordered), in_order(samples, list(marked)), marked)


def in_order(samples: Samples, contestants: Sequence[PolicyRun]) -> Samples:
    """The same samples, by contestant, task and telling.

    The bootstrap takes them one after the other, and episodes end in any order.
    """
    tasks = task_order({task for _, task, _ in samples})
    keys = sorted(
        samples,
        key=lambda key: (contestants.index(key[0]), tasks.index(key[1]), key[2].sort_key()),
    )
    return {key: samples[key] for key in keys}


def task_order(names: Iterable[str]) -> list[str]:
    """Tasks as in the benchmark, unknown ones at the end."""
    known = list(all_tasks())
    return sorted(
        names, key=lambda name: (known.index(name) if name in known else len(known), name)
    )


def _planned_order(runs: Sequence[Run]) -> list[str]:
    jobs: list[Job] = [job for run in runs for job in (*run.planned, *run.records)]
    return list(dict.fromkeys(job.policy for job in jobs))


def _privileged(entries: Iterable[EpisodeEntry]) -> set[str]:
    return {one.record.policy for one in entries if one.record.privileged}
