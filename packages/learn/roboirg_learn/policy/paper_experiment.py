"""The paper's experiment with its mechanisms on the small body: train them, and play its tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from urllib.parse import quote

from roboirg.extension.commands import InvalidValueError, known_name
from roboirg.extension.episodes import all_settings
from roboirg.extension.pages import read_plan_file
from roboirg_learn.policy.policy_files import PolicyFiles
from roboirg_learn.policy.policy_plan import MEMORY_NAMES, PLANNERS, BodyPlan

if TYPE_CHECKING:
    from roboirg_learn.listener.reader_plan import ReaderPlan
    from roboirg_learn.trainer import Progress

SYSTEMS: Mapping[str, str] = {
    "none": "pi0.5",
    "ttt": "TTT-Expert",
    "framesamp": "FrameS-Modul",
    "subgoal": "GroundSG-QwenVL",
    "keyframes": "MemER",
}
"""The paper's system with the mechanism of each memory."""
MAIN = "main"
RESOLVED = "resolved"
CONTEXT = "context"
PLANNER = "planner"
PARTS: Mapping[str, str] = {
    MAIN: "paper",
    RESOLVED: "paper",
    CONTEXT: "paper-context",
    PLANNER: "paper-planners",
}
"""The packaged plan that each part of the experiment changes. Resolved forms join the main run."""
HELD_OUT = "test"
"""The pool of words that is spoken in every split: that of the packaged plans' split."""
PARTS_WITH_OWN_TASKS = (CONTEXT, PLANNER)
"""Parts with three tasks of their own."""
RUNS = "runs"
"""Folder of the runs."""


class ExperimentPlan(NamedTuple):
    """What is trained and played.

    Attributes:
        memories: names of memories; each is a row of the tables. Those that no system of the paper
            has are no part of its experiment, but can be played with the others.
        parts: names of `PARTS`.
        played: settings that are played; () for those of the paper's plans.
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


def row_name(memory: str) -> str:
    """Return what a row's policy is called, by its mechanism, not by the paper's system.

    ``framesamp`` → ``small-framesamp``.
    """
    return f"small-{memory}"


def train_rows(
    experiment: ExperimentPlan,
    plan: BodyPlan,
    reader_plan: ReaderPlan,
    folder: Path,
    workers: int,
    progress: Progress,
) -> dict[str, PolicyFiles]:
    """Train the policy of each row, one for each memory; return their files by the row's name.

    Files that are there already are used again.

    Args:
        experiment: the memories, each a row.
        plan: of the bodies; its memory is replaced by the row's.
        reader_plan: how their reader learns.
        folder: for recordings and files.
        workers: processes that record and render.
        progress: called with the row and a kind of work, what is done of it, and all of it.
    """
    from roboirg_learn.policy.policy_training import trained_files
    from roboirg_learn.trainer import part_of

    found = {}
    for memory in experiment.memories:
        row = row_name(memory)
        row_plan = plan._replace(memory=memory)
        show = part_of(progress, row)
        found[row] = trained_files(row_plan, reader_plan, folder, workers, show)
    return found


def part_options(
    part: str,
    experiment: ExperimentPlan,
    files: Mapping[str, PolicyFiles],
    changes: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the arguments of `roboirg.evaluate` that play one part of the experiment.

    They are those of the packaged plan, with the trained policies in place of its own.

    Args:
        part: a name of `PARTS`.
        experiment: which rows, and which settings.
        files: of each row's policy.
        changes: options that replace the plan's, such as ``{"episodes": "2"}``; parts with tasks of
            their own keep those.
    """
    options = read_plan_file(PARTS[part])
    options.pop("policies", None)
    options["forms"] = ["implicit", RESOLVED] if part == RESOLVED else ["implicit"]
    options["policy_seeds"] = 0
    if experiment.played and part != CONTEXT:
        options["settings"] = experiment.played
    if changes.get("split", options["split"]) != options["split"]:
        options["wordings"] = HELD_OUT
    for name, value in changes.items():
        is_fixed = name == "tasks" and part in PARTS_WITH_OWN_TASKS
        if not is_fixed:
            options[name] = value
    options["policy"] = {row: of_row.spec for row, of_row in files.items()}
    if part == PLANNER:
        options["policy"] = _planner_pairings(experiment, options["policy"])
    return options


def _planner_pairings(experiment: ExperimentPlan, rows: Mapping[str, str]) -> dict[str, str]:
    """Return policies that pair planners with hands, by row: its name → its spec.

    A planner names subgoals, hands follow them. Each trained policy with a planner plays as it is;
    with a stronger planner, the benchmark's listener; and with stronger, scripted hands. At last
    both stronger ones play together.

    Args:
        experiment: the memories of the rows.
        rows: the spec of each row's policy.
    """
    found = {}
    for memory in experiment.memories:
        if memory in PLANNERS:
            row = row_name(memory)
            spec = rows[row]
            hands = quote(spec, safe=":/?=")
            found[row] = spec
            found[f"{row}-interpreter"] = f"planner:listener?hands={hands}"
            found[f"{row}-scripted-hands"] = f"{spec}&hands=scripted"
    found["interpreter-scripted-hands"] = "planner:listener?hands=scripted"
    return found
