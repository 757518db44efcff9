"""The paper's experiment with its mechanisms on the small body: train them, and play its tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from roboirg.extension.commands import InvalidValueError, known_name
from roboirg.extension.episodes import all_settings
from roboirg.extension.pages import read_plan_file
from roboirg_learn.policy.policy_plan import MEMORY_NAMES, PLANNERS, PolicyPlan

if TYPE_CHECKING:
    from roboirg_learn.trainer import Progress

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
RUNS = "runs"
"""Folder of the runs."""


class ExperimentPlan(NamedTuple):
    """What is trained and played.

    Attributes:
        memories: names of memories; each is a row. Those that no system has are no part of the
            paper's experiment, but can be played with the others.
        parts: names of `PARTS`.
        played: settings that are played; none for those of the paper's plans.
    """

    memories: tuple[str, ...] = tuple(SYSTEMS)
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
    for setting in experiment.played:
        known_name("setting", setting, tuple(all_settings()))
    if PLANNER in experiment.parts and not set(experiment.memories) & set(PLANNERS):
        raise InvalidValueError(
            f"The part 'planner' needs a memory with a planner ({' or '.join(PLANNERS)}), but the "
            f"memories are {', '.join(experiment.memories)}; name one, or parts without 'planner'."
        )


def row_name(memory: str, change: str = "") -> str:
    """Return what a row's policy is called: by its mechanism, never by a system."""
    return f"small-{memory}{change}"


def train_rows(
    experiment: ExperimentPlan, plan: PolicyPlan, folder: Path, workers: int, progress: Progress
) -> dict[str, Path]:
    """Return the file of each row's policy; what is there already is used again.

    Args:
        experiment: which rows.
        plan: of the training; its memory is the rows'.
        folder: for recordings and files.
        workers: processes that record.
        progress: called with the row and a kind of work, what is done of it, and all of it.
    """
    from roboirg_learn.policy.policy_training import trained_file
    from roboirg_learn.trainer import part_of

    return {
        row_name(memory): trained_file(
            plan._replace(memory=memory), folder, workers, part_of(progress, row_name(memory))
        )
        for memory in experiment.memories
    }


def part_options(
    part: str, experiment: ExperimentPlan, files: Mapping[str, Path], changes: Mapping[str, Any]
) -> dict[str, Any]:
    """Return a part's options of `roboirg.evaluate`: the packaged plan's with the rows as policies.

    Args:
        part: a name of `PARTS`.
        experiment: which rows.
        files: of each row.
        changes: other options; tasks do not change parts with tasks of their own.
    """
    given = read_plan_file(PARTS[part])
    given.pop("policies", None)
    given["forms"] = ["implicit", *([RESOLVED] if part == RESOLVED else [])]
    given["policy_seeds"] = 0
    if experiment.played and part != CONTEXT:
        given["settings"] = experiment.played
    if part in OWN_TASKS:
        changes = {name: one for name, one in changes.items() if name != "tasks"}
    if changes.get("split", given["split"]) != given["split"]:
        given["wordings"] = HELD_OUT
    rows = {name: f"trained:{path}" for name, path in files.items()}
    policy = _with_planners(experiment, rows) if part == PLANNER else rows
    return {**given, **changes, "policy": policy}


def _with_planners(experiment: ExperimentPlan, rows: Mapping[str, str]) -> dict[str, str]:
    """Return the rows with planners, and the same hands and planners with others.

    The stronger planner is the interpreter of the words; the stronger hands are the scripted ones.
    """
    found = {}
    for memory in (one for one in experiment.memories if one in PLANNERS):
        own = rows[row_name(memory)]
        found[row_name(memory)] = own
        found[row_name(memory, "-interpreter")] = f"planner:listener?hands={own}"
        found[row_name(memory, "-scripted-hands")] = f"{own}?hands=scripted"
    found["interpreter-scripted-hands"] = "planner:listener?hands=scripted"
    return found
