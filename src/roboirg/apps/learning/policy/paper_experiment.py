"""The paper's experiment with its mechanisms on the small body: train them, and play its tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import PositiveInt

from roboirg.apps.learning.policy.policy_plan import MEMORY_NAMES, PLANNERS, PolicyPlan
from roboirg.cli.names import known_name, known_settings
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.plan.plan_file import read_plan_file

if TYPE_CHECKING:
    from roboirg.apps.learning.trainer import Progress

SYSTEMS: Mapping[str, str] = {
    "none": "pi0.5",
    "ttt": "TTT-Expert",
    "framesamp": "FrameS-Modul",
    "subgoal": "GroundSG-QwenVL",
    "keyframes": "MemER",
}
"""The paper's system with the mechanism of each memory."""
MAIN, RESOLVED, CONTEXT, PLANNER = "main", "resolved", "context", "planner"
PARTS: Mapping[str, str] = {
    MAIN: "paper",
    RESOLVED: "paper",
    CONTEXT: "paper-context",
    PLANNER: "paper-planners",
}
"""The packaged plan that each part of the experiment changes. Resolved forms join the main run."""
HELD_OUT = "test"
"""The pool of words that is spoken in every split: that of the packaged plans' split."""
OWN_TASKS = (CONTEXT, PLANNER)
"""Parts with three tasks of their own."""
SEED_MARK = "-seed"
"""Between the name of a row and a training seed other than 0."""
RUNS = "runs"
"""Folder of the runs."""


class ExperimentPlan(NamedTuple):
    """What is trained and played.

    Attributes:
        memories: names of memories; each is a row. Those that no system has are no part of the
            paper's experiment, but can be played with the others.
        seeds: training seeds, from 0.
        parts: names of `PARTS`.
        played: settings that are played; none for those of the paper's plans.
    """

    memories: tuple[str, ...] = tuple(SYSTEMS)
    seeds: PositiveInt = 1
    parts: tuple[str, ...] = tuple(PARTS)
    played: tuple[str, ...] = ()


def check_experiment(experiment: ExperimentPlan) -> None:
    """Check the names of an experiment, before hours are spent on it.

    Raises:
        InvalidValueError: there is no memory, part or setting of a name, or a part has no rows.
    """
    for memory in experiment.memories:
        known_name("memory", memory, MEMORY_NAMES)
    for part in experiment.parts:
        known_name("part", part, tuple(PARTS))
    known_settings(",".join(experiment.played) or "all")
    if PLANNER in experiment.parts and not set(experiment.memories) & set(PLANNERS):
        raise InvalidValueError(
            f"The part 'planner' needs a memory with a planner ({' or '.join(PLANNERS)}), but the "
            f"memories are {', '.join(experiment.memories)}; name one, or parts without 'planner'."
        )


def row_name(memory: str, seed: int = 0, change: str = "") -> str:
    """Return what a row's policy is called: by its mechanism, never by a system."""
    return f"small-{memory}{change}" + (f"{SEED_MARK}{seed}" if seed else "")


def row_of(policy: str) -> tuple[str, int]:
    """Return the row of a policy, and its training seed."""
    row, _, seed = policy.partition(SEED_MARK)
    return row, int(seed or 0)


def train_rows(
    experiment: ExperimentPlan, plan: PolicyPlan, folder: Path, workers: int, progress: Progress
) -> dict[str, Path]:
    """Return the file of each row's policy; what is there already is used again.

    Args:
        experiment: which rows.
        plan: of the training; its memory and seed are the rows'.
        folder: for recordings and files.
        workers: processes that record.
        progress: called with the row and a kind of work, what is done of it, and all of it.
    """
    from roboirg.apps.learning.policy.policy_model import load_policy, save_policy
    from roboirg.apps.learning.policy.policy_training import check_same_plan, train_policy
    from roboirg.apps.learning.trainer import part_of

    found = {}
    for seed in range(experiment.seeds):
        for memory in experiment.memories:
            own, name = plan._replace(memory=memory, seed=seed), row_name(memory, seed)
            path = folder / f"{own.name}.pt"
            if not path.exists():
                save_policy(train_policy(own, folder, workers, part_of(progress, name)), path)
            check_same_plan(own, load_policy(path), path)
            found[name] = path
    return found


def part_options(
    part: str, experiment: ExperimentPlan, files: Mapping[str, Path], changes: Mapping[str, Any]
) -> dict[str, Any]:
    """Return a part's options of `make_plan`: the packaged plan's with the rows as policies.

    Args:
        part: a name of `PARTS`.
        experiment: which rows.
        files: of each row.
        changes: other options of `make_plan`; tasks do not change parts with tasks of their own.
    """
    given = read_plan_file(PARTS[part])
    given["forms"] = ["implicit", *([RESOLVED] if part == RESOLVED else [])]
    given["policy_seeds"] = 0
    if experiment.played and part != CONTEXT:
        given["settings"] = experiment.played
    if part in OWN_TASKS:
        changes = {name: one for name, one in changes.items() if name != "tasks"}
    if changes.get("split", given["split"]) != given["split"]:
        given["wordings"] = HELD_OUT
    policies = _with_planners(experiment, files) if part == PLANNER else _rows(files)
    named = [f"{name}={spec}" for name, spec in policies.items()]
    return {**given, **changes, "policies": named}


def _rows(files: Mapping[str, Path]) -> dict[str, str]:
    return {name: f"trained:{path}" for name, path in files.items()}


def _with_planners(experiment: ExperimentPlan, files: Mapping[str, Path]) -> dict[str, str]:
    """Return the rows with planners, and the same hands and planners with others.

    The stronger planner is the interpreter of the words; the stronger hands are the scripted ones.
    """
    found = {}
    for seed in range(experiment.seeds):
        for memory in (one for one in experiment.memories if one in PLANNERS):
            name = row_name(memory, seed)
            own = f"trained:{files[name]}"
            found[name] = own
            found[row_name(memory, seed, "-interpreter")] = f"planner:listener?hands={own}"
            found[row_name(memory, seed, "-scripted-hands")] = f"{own}?hands=scripted"
    if found:
        found["interpreter-scripted-hands"] = "planner:listener?hands=scripted"
    return found


def run_of(folder: Path, part: str) -> Path:
    """Return the folder of the run to which a part belongs."""
    return folder / RUNS / (MAIN if part == RESOLVED else part)
