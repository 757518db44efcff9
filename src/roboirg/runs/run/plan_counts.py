"""Count a plan's episodes, and the calls of models that they take at least."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping

from roboirg.records.record import Job
from roboirg.runs.job_instruction import PreparedJob


def cell_sizes(jobs: Iterable[Job]) -> Mapping[tuple[str, str], Mapping[str, Counter[str]]]:
    """Return the number of episodes by policy and task, and in these by setting and by form.

    ``{("mine", "PickXtimes"): {"direct": {"implicit": 50}}}`` are 50 in all.
    """
    sizes: dict[tuple[str, str], dict[str, Counter[str]]] = {}
    for job in jobs:
        by_setting = sizes.setdefault((job.policy, job.task), {})
        by_form = by_setting.setdefault(job.setting, Counter())
        by_form[job.form] += 1
    return sizes


def least_calls(jobs: Iterable[Job]) -> Mapping[tuple[str, str], int]:
    """Return how often policies at least call a language model, by policy and setting.

    Policies that call none are left out. One that reads the whole instruction calls once an
    episode. A planner, which names one subgoal after the other, calls at least once for each stage
    of the goal; many call more often, before every chunk of actions.
    """
    calls: Counter[tuple[str, str]] = Counter()
    for job in jobs:
        if job.ref is None or job.ref.asks is None:
            continue
        count = 1
        if job.ref.asks == "planner":
            count = len(PreparedJob(job).episode.stages)
        calls[job.policy, job.setting] += count
    return calls
