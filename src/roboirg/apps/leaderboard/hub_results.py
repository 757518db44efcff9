"""A policy's results in the format in which Hugging Face shows them on the page of a model."""

from __future__ import annotations

import re
from collections import Counter

import yaml

from roboirg.analysis.measures.comparison import only_policy_run
from roboirg.analysis.measures.measure import measure
from roboirg.analysis.results.frame import Frame
from roboirg.core.errors import InvalidValueError
from roboirg.language.settings import settings_of
from roboirg.tasks import all_tasks


def hub_results(frame: Frame, dataset: str) -> str:
    """Return a file ``.eval_results/*.yaml`` with a policy's success rates, in percent.

    It has an entry for the mean of spatial and grounded, by which models are ranked, then one for
    each setting; a setting's rate is the mean over its tasks. The gap to explicit could not rank,
    as a policy that never moves has none. Control arms, resolved forms, and settings of which a
    task or a planned episode lacks a verdict are left out.

    Args:
        frame: results of one policy.
        dataset: repository of the benchmark at the hub, ``OWNER/NAME``, whose ``eval.yaml`` lists
            the tasks of these entries.

    Raises:
        InvalidValueError: a repository has no such name; or the results are of several policies or
            conditions, of a policy that reads the simulator's state, not of the split test in our
            own words, or without one of the two settings.
    """
    if not re.fullmatch(r"[\w.-]+/[\w.-]+", dataset):
        raise InvalidValueError(f"dataset is {dataset!r}; it must be OWNER/NAME.")
    frame = frame.without_control_arms().where(form="implicit")
    run = only_policy_run(frame)
    rates = _complete_rates(frame)
    is_of_test = run.conditions.split == "test" and run.conditions.wordings is None
    if run.is_privileged or not is_of_test or not rates.keys() >= {"spatial", "grounded"}:
        raise InvalidValueError(
            f"{run.marked_policy} has no results for the hub; these are complete in every task "
            "of spatial and grounded, of the split test, in our own words, and without the "
            "simulator's state."
        )
    main = (rates["spatial"] + rates["grounded"]) / 2
    entries = []
    for task_id, rate in {"spatial-and-grounded": main, **rates}.items():
        entry = {
            "dataset": {"id": dataset, "task_id": task_id},
            "value": round(100 * rate, 1),
            "notes": f"language {run.language}",
        }
        entries.append(entry)
    return yaml.safe_dump(entries, sort_keys=False)


def _complete_rates(frame: Frame) -> dict[str, float]:
    """Return the rate of each setting of which all tasks are complete."""
    tasks_of = Counter[str]()
    for task in all_tasks().values():
        tasks_of.update(settings_of(task))
    rates = {}
    for row in measure(frame, ["setting"]):
        (setting,) = row.key
        has_all_tasks = len(row.cells) == tasks_of[setting]
        if row.rate is not None and row.counts.is_complete and has_all_tasks:
            rates[setting] = float(row.rate)
    return rates
