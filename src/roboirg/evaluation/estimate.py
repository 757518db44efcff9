"""What a plan amounts to, before it is played."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from statistics import fmean
from typing import NamedTuple

from roboirg.records.record import Job
from roboirg.records.record_codec import RecordIndexEntry

ASSUMED_STEPS = 450
"""Control steps of an episode if nothing is known: the oracle's mean over the test split, 236,
about doubled, since policies are slower and some use up their limit."""
STEP_S = 0.002
"""Seconds of a control step with its share of a pair of pictures every 16 steps, on a core of a
laptop (docs/performance.md); the policy's own time is not known."""


class Estimate(NamedTuple):
    """How long a plan takes.

    Attributes:
        episodes: to be played.
        seconds: on all workers together, side by side.
        most_steps: control steps if every episode used up its limit.
        is_measured: whether it rests on episodes that have been played, else on a simulator whose
            policies take no time.
    """

    episodes: int
    seconds: float
    most_steps: int
    is_measured: bool


def cell_sizes(jobs: Iterable[Job]) -> Mapping[tuple[str, str], Mapping[str, Counter[str]]]:
    """How many episodes there are by policy and task, in these by setting, in these by form."""
    sizes: defaultdict[tuple[str, str], defaultdict[str, Counter[str]]]
    sizes = defaultdict(lambda: defaultdict(Counter))
    for job in jobs:
        sizes[job.policy, job.task][job.setting][job.form] += 1
    return sizes


def estimate(jobs: Iterable[Job], played: Iterable[RecordIndexEntry], workers: int) -> Estimate:
    """How long jobs take.

    Args:
        jobs: to be played.
        played: episodes whose durations are known; those of the same policy and task count most.
        workers: how many processes.
    """
    durations = _MeanDurations(played)
    total, known, steps, count = 0.0, True, 0, 0
    for job in jobs:
        duration = durations.of(job)
        known = known and duration is not None
        total += _assumed_duration(job) if duration is None else duration
        steps += job.max_steps
        count += 1
    return Estimate(count, total / max(workers, 1), steps, known and count > 0)


def estimate_text(found: Estimate, planned: int, workers: int) -> tuple[str, ...]:
    """An estimate as lines to read."""
    lines = [f"{planned} episodes, {planned - found.episodes} of them are there already."]
    if found.episodes:
        basis = (
            "judging by the episodes that are there"
            if found.is_measured
            else f"at {ASSUMED_STEPS} steps an episode, without the policy's own time"
        )
        lines.append(
            f"The other {found.episodes} take about {_clock(found.seconds)} on {workers} "
            f"worker{'' if workers == 1 else 's'}, {basis}; at most {found.most_steps} control "
            "steps."
        )
    return tuple(lines)


def _clock(seconds: float) -> str:
    minutes = round(seconds / 60)
    if minutes < 1:
        return f"{max(round(seconds), 1)} s"
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"  # noqa: PLR2004


class _MeanDurations:
    """Mean durations of episodes that have been played."""

    def __init__(self, played: Iterable[RecordIndexEntry]) -> None:
        self._known: defaultdict[tuple[str, str | None], list[float]] = defaultdict(list)
        for one in played:
            if one.outcome != "error":
                for key in ((one.policy, one.task), (one.policy, None)):
                    self._known[key].append(one.duration_s)

    def of(self, job: Job) -> float | None:
        """Of the same policy and task, or of the same policy; None if it never played."""
        for key in ((job.policy, job.task), (job.policy, None)):
            if key in self._known:
                return fmean(self._known[key])
        return None


def _assumed_duration(job: Job) -> float:
    return STEP_S * min(job.max_steps, ASSUMED_STEPS)
