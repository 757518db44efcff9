"""Estimate how long a plan takes before it is played."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from statistics import fmean
from typing import NamedTuple

from roboirg.records.record import Job
from roboirg.records.record_codec import RecordIndexEntry
from roboirg.util.plurals import counted

ASSUMED_STEPS = 450
"""Assumed control steps of an episode: the oracle's mean over the test split, 236, about doubled,
because policies are slower and some use up their limit."""
STEP_S = 0.002
"""Seconds per control step on one laptop core, with two pictures every 16 steps
(docs/performance.md); the policy's own time is unknown."""


class Estimate(NamedTuple):
    """Estimated time of a plan.

    Attributes:
        episodes: number of episodes to play.
        seconds: wall-clock time with all workers in parallel.
        max_steps: control steps if every episode uses up its limit.
        is_measured: whether it is based on stored episodes; otherwise policies take no time in it.
    """

    episodes: int
    seconds: float
    max_steps: int
    is_measured: bool


def cell_sizes(jobs: Iterable[Job]) -> Mapping[tuple[str, str], Mapping[str, Counter[str]]]:
    """Return the number of episodes by (policy, task), then by setting, then by form."""
    sizes: defaultdict[tuple[str, str], defaultdict[str, Counter[str]]]
    sizes = defaultdict(lambda: defaultdict(Counter))
    for job in jobs:
        sizes[job.policy, job.task][job.setting][job.form] += 1
    return sizes


def estimate(jobs: Iterable[Job], played: Iterable[RecordIndexEntry], workers: int) -> Estimate:
    """Estimate how long jobs take.

    Args:
        jobs: jobs to play.
        played: episodes with known durations; those of the same policy and task are preferred.
        workers: number of processes.
    """
    durations = _MeanDurations(played)
    total, known, steps, count = 0.0, True, 0, 0
    for job in jobs:
        duration = durations.mean(job)
        known = known and duration is not None
        total += _assumed_duration(job) if duration is None else duration
        steps += job.max_steps
        count += 1
    return Estimate(count, total / max(workers, 1), steps, known and count > 0)


def estimate_text(found: Estimate, planned: int, workers: int) -> tuple[str, ...]:
    """Return an estimate as lines of text."""
    lines = [f"{counted(planned, 'episode')}, {planned - found.episodes:,} already stored."]
    if found.episodes:
        basis = (
            "based on the stored episodes"
            if found.is_measured
            else f"assuming {ASSUMED_STEPS} steps per episode and no time for the policy"
        )
        lines.append(
            f"The other {found.episodes:,} take about {_format_duration(found.seconds)} on "
            f"{counted(workers, 'worker')}, {basis}; at most {found.max_steps:,} control steps."
        )
    return tuple(lines)


def _format_duration(seconds: float) -> str:
    minutes = round(seconds / 60)
    if minutes < 1:
        return f"{max(round(seconds), 1)} s"
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"  # noqa: PLR2004


class _MeanDurations:
    """Mean durations of stored episodes."""

    def __init__(self, played: Iterable[RecordIndexEntry]) -> None:
        self._known: defaultdict[tuple[str, str | None], list[float]] = defaultdict(list)
        for one in played:
            if one.outcome != "error":
                for key in ((one.policy, one.task), (one.policy, None)):
                    self._known[key].append(one.duration_s)

    def mean(self, job: Job) -> float | None:
        """Return the mean of the same policy and task, else of the same policy, else None."""
        for key in ((job.policy, job.task), (job.policy, None)):
            if key in self._known:
                return fmean(self._known[key])
        return None


def _assumed_duration(job: Job) -> float:
    return STEP_S * min(job.max_steps, ASSUMED_STEPS)
