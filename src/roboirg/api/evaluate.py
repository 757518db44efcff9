"""`roboirg.evaluate`: play policies from Python and get their results."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from roboirg.core.errors import check_names

if TYPE_CHECKING:
    from roboirg.analysis.run_results import Results
    from roboirg.api.python_run import AnyPolicy

# Imported inside, so that `import roboirg` stays fast.


def evaluate(
    policy: AnyPolicy | Sequence[AnyPolicy] | Mapping[str, AnyPolicy],
    *,
    tasks: str | Iterable[str] = "all",
    settings: str | Iterable[str] = "all",
    forms: str | Iterable[str] = "implicit",
    split: str = "test",
    episodes: int | str | Iterable[int] = 4,
    policy_seeds: int | str | Iterable[int] = 0,
    out: str | Path | None = None,
    workers: int | None = None,
    video: str = "off",
    progress: bool = True,
    **options: object,
) -> Results:
    """Play policies and return their results; the records are those of ``roboirg run``.

    A script needs ``if __name__ == "__main__":`` around the call, because worker processes import
    it, unless ``workers=0``.

    Args:
        policy: a built-in name, ``package.module:Class`` or an address; a class; an object with
            ``reset`` and ``act``; or several of them, in a list or by name in a mapping. Classes
            that other processes cannot import, as those of a notebook, and objects play in this
            process, one episode after the other.
        tasks: names of tasks or suites.
        settings: explicit, direct, reasoning, contextual, spatial.
        forms: implicit, resolved.
        split: train, val, test or random.
        episodes: number of episodes, or their positions in the split.
        policy_seeds: every seed plays every episode.
        out: folder of the run; the same one again resumes. None makes a new one in ``runs``.
        workers: processes, by default one for each core; 0 for this process.
        video: off, failures or all.
        progress: whether to show it on stderr.
        **options: other fields of `roboirg.runs.plan.plan.Plan`, as ``max_steps=600``.

    Returns:
        The results of all episodes in the folder.

    Raises:
        UnknownNameError: a policy, task, setting, … does not exist.
        InvalidValueError: a number or combination is out of range.
        StoreError: the folder cannot be written, or holds records of other versions.
    """
    from roboirg.analysis.run_results import Results
    from roboirg.api.python_run import play_plan, python_plan
    from roboirg.runs.plan.plan_fields import PLAN_KEYS

    # The nearest name may be a parameter's, too.
    known = (*inspect.signature(evaluate).parameters, *PLAN_KEYS)
    check_names("option of evaluate()", options, known)
    plan = python_plan(
        policy, tasks=tasks, settings=settings, forms=forms, split=split, episodes=episodes,
        policy_seeds=policy_seeds, video=video, **options,
    )  # fmt: skip
    return Results(play_plan(plan, out, workers=workers, progress=progress))
