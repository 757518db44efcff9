"""Count a plan's episodes, and the calls of models that they take at least."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping

from roboirg.evaluation.play.job_instruction import PreparedJob
from roboirg.evaluation.records.record import Job


def cell_sizes(jobs: Iterable[Job]) -> Mapping[tuple[str, str], Mapping[str, Counter[str]]]:
    """Return the number of episodes by (policy, task), then by setting, then by form."""
    sizes = defaultdict[tuple[str, str], defaultdict[str, Counter[str]]](
        lambda: defaultdict(Counter)
    )
    for job in jobs:
        sizes[job.policy, job.task][job.setting][job.form] += 1
    return sizes


def least_calls(jobs: Iterable[Job]) -> Mapping[tuple[str, str], int]:
    """Return the least calls of models by policy and setting, for policies that ask one.

    A listener asks once an episode. A planner that names the right subgoals asks at least once for
    each of them; many ask more often, before every chunk of their hands.
    """
    calls: Counter[tuple[str, str]] = Counter()
    for job in jobs:
        asks = None if job.ref is None else job.ref.asks
        if asks is not None:
            count = 1 if asks == "listener" else len(PreparedJob(job).episode.stages)
            calls[job.policy, job.setting] += count
    return calls
