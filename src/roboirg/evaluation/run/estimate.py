"""Estimate how long a plan takes before it is played."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from statistics import fmean
from typing import NamedTuple

from roboirg.core.plain_text import counted
from roboirg.evaluation.records.record import Job, Summary
from roboirg.evaluation.run.world_speed import WorldSpeed

ORACLE_STEPS = 236
"""Mean control steps of the oracle over the test split."""


class Estimate(NamedTuple):
    """Estimated time of a plan, wall-clock seconds with all workers in parallel.

    Attributes:
        episodes: number of episodes to play.
        least: if policies need as many steps as the oracle.
        most: if they use up their limit in every episode.
        max_steps: control steps in that case.
        unknown: episodes of policies that have not been played here, whose own time is not in it.
    """

    episodes: int
    least: float
    most: float
    max_steps: int
    unknown: int


def cell_sizes(jobs: Iterable[Job]) -> Mapping[tuple[str, str], Mapping[str, Counter[str]]]:
    """Return the number of episodes by (policy, task), then by setting, then by form."""
    sizes: defaultdict[tuple[str, str], defaultdict[str, Counter[str]]]
    sizes = defaultdict(lambda: defaultdict(Counter))
    for job in jobs:
        sizes[job.policy, job.task][job.setting][job.form] += 1
    return sizes


def estimate(
    jobs: Iterable[Job], played: Iterable[Summary], workers: int, speed: WorldSpeed
) -> Estimate:
    """Estimate how long jobs take.

    Args:
        jobs: jobs to play.
        played: episodes with known durations; those of the same policy and task are preferred.
        workers: number of processes that have a core each.
        speed: of the world.
    """
    durations = _MeanDurations(played)
    least, most, steps, count, unknown = 0.0, 0.0, 0, 0, 0
    for job in jobs:
        duration = durations.mean(job)
        if duration is None:
            least += speed.seconds(job, ORACLE_STEPS)
            most += speed.seconds(job, job.max_steps)
            unknown += 1
        else:
            least, most = least + duration, most + duration
        steps += job.max_steps
        count += 1
    return Estimate(count, least / max(workers, 1), most / max(workers, 1), steps, unknown)


def estimate_text(
    found: Estimate, planned: int, workers: int, speed: WorldSpeed
) -> tuple[str, ...]:
    """Return an estimate as lines of text."""
    lines = [f"{counted(planned, 'episode')}, {planned - found.episodes:,} already stored."]
    if not found.episodes:
        return tuple(lines)
    times = [_format_duration(seconds) for seconds in (found.least, found.most)]
    where = f"on {counted(workers, 'worker')}"
    which = "the other" if found.episodes < planned else "all"
    others = f"Playing {which} {found.episodes:,} takes about"
    if not found.unknown:
        return (*lines, f"{others} {times[0]} {where}, as long as the stored ones.")
    basis = "measured just now" if speed.is_measured else "assumed, as nothing can be played here"
    lines.append(
        f"{others} {times[0]} {where} if policies need as many steps as the oracle, "
        f"{times[1]} if they use up their limit ({found.max_steps:,} control steps in all)."
    )
    lines.append(
        f"A control step of the world takes {1000 * speed.step_s:.1f} ms ({basis}); policies and "
        "videos take more. Policies were not run; roboirg check-policy checks their actions."
    )
    return tuple(lines)


def _format_duration(seconds: float) -> str:
    minutes = round(seconds / 60)
    if minutes < 1:
        return f"{max(round(seconds), 1)} s"
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"  # noqa: PLR2004


class _MeanDurations:
    """Mean durations of stored episodes."""

    def __init__(self, played: Iterable[Summary]) -> None:
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
