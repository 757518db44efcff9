"""Whether a rate can be compared with the published one of its cell, and what differs if not.

Only the explicit setting can be repeated: its episodes are RoboMME's test episodes and its words
RoboMME's, which a wording file brings. The paper's implicit instructions are not published.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence

from roboirg.analysis.published import PUBLISHED_MAX_STEPS, TRIALS, published_tasks
from roboirg.analysis.results.frame import RunNames
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.analysis.results.run_cells import CellKey
from roboirg.core.arms import TOLD
from roboirg.core.environment_options import DEFAULT_MESHES
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.plain_text import counted
from roboirg.core.versions import Versions
from roboirg.core.word_pools import ROBOMME_NAME, words_label
from roboirg.language.settings import EXPLICIT
from roboirg.stats.cells import Cell

Differences = tuple[str, ...]
"""What differs from the published rate; empty if the two can be compared."""
AllDifferences = Mapping[CellKey, Differences | None]
"""The differences of cells; None where there is nothing to compare."""

IMPLICIT: Differences = ("the paper's instructions are not published",)
REAL: Differences = ("the paper's own robot",)

COMPARABLE_SIGN = "="
DIFFERENT_SIGN = "≠"

_SPLIT = "test"
_COMPARABLE = Versions(environment_version=ENVIRONMENT_VERSION)  # of others nothing is published


def differences_of(key: CellKey, cell: Cell) -> Differences | None:
    """Return how the conditions of a cell (a task in a setting) differ from the published rate's.

    For example ``("split train", "900 steps instead of 1300")``; empty if the two rates can be
    compared. The number of policy seeds makes no difference, nor does it matter what the policy is.

    Args:
        key: policy run, task and instruction options.
        cell: its trials.

    Returns:
        None if nothing is published for the task, or if the cell has no rate.
    """
    if not cell.verdicts:
        return None
    if key.task in published_tasks("real"):
        return REAL
    if key.task not in published_tasks("main"):
        return None
    if key.options.setting != EXPLICIT:
        return IMPLICIT
    return tuple(_explicit_differences(key.policy_run, cell))


def merged(differences: Iterable[Differences | None]) -> Differences | None:
    """Return how an average of cells differs from the published one: all that a cell differs in.

    None if one of them has no published rate to compare with.
    """
    merged_differences: list[str] = []
    for differences_of_cell in differences:
        if differences_of_cell is None:
            return None
        merged_differences += differences_of_cell
    return tuple(dict.fromkeys(merged_differences))


def comparison_sign(differences: Differences | None) -> str:
    """Return the sign of a rate; empty if no rate of its kind can ever be compared."""
    if differences in (None, IMPLICIT, REAL):
        return ""
    return DIFFERENT_SIGN if differences else COMPARABLE_SIGN


def comparison_notes(found: AllDifferences, names: RunNames) -> list[str]:
    """Return sentences on which rates can be compared with published ones, and why others cannot.

    Args:
        found: for each cell, in what it differs from the published rate; empty if in nothing.
        names: labels of the policy runs.
    """
    notes = []
    if () in found.values():  # nothing differs
        notes.append(
            f"{COMPARABLE_SIGN} comparable with the published rate: RoboMME's test episodes, "
            "words, step limit and world."
        )
    notes += _different_notes(found, names)
    if IMPLICIT in found.values():
        notes.append(
            f"Implicit settings are not comparable with the published rates: {IMPLICIT[0]}."
        )
    if REAL in found.values():
        notes.append(f"These rates are not comparable with the published rates: {REAL[0]}.")
    return notes


def _different_notes(found: AllDifferences, names: RunNames) -> Iterator[str]:
    """Yield sentences on why rates of explicit instructions cannot be compared with published ones.

    Policies for which the reasons are the same share a sentence, such as ``≠ not comparable with
    the published rate (pi0, max steps 900): 900 steps instead of 1300.`` They are named only if
    there are others.
    """
    runs_by_text = _runs_by_text(found)
    for text, policy_runs in runs_by_text.items():
        if not text:
            continue  # nothing differs
        who = ""
        if len(runs_by_text) > 1:
            who = f" ({'; '.join(names[policy_run] for policy_run in policy_runs)})"
        yield f"{DIFFERENT_SIGN} not comparable with the published rate{who}: {text}."


def _runs_by_text(found: AllDifferences) -> Mapping[str, Sequence[PolicyRun]]:
    """Return the policy runs by what differs from the published rates; an empty text for nothing.

    For example ``{"900 steps instead of 1300": [pi0, oracle], "": [smolvla]}``. Policy runs without
    a rate that could be compared are left out.
    """
    runs: dict[PolicyRun, dict[str, Differences]] = {}
    for key, differences in found.items():
        if differences is not None and comparison_sign(differences):
            runs.setdefault(key.policy_run, {})[key.task] = differences
    runs_by_text = defaultdict(list)
    for policy_run, tasks in runs.items():
        runs_by_text[_text(tasks)].append(policy_run)
    return runs_by_text


def _text(tasks: Mapping[str, Differences]) -> str:
    """Return the differences from published rates in one text, given those of each task.

    For example ``split train; 1 error (PickXtimes, StopCube)``; a difference of all tasks names
    none.
    """
    tasks_by_difference = defaultdict(list)
    for task, differences in tasks.items():
        for difference in differences:
            tasks_by_difference[difference].append(task)
    parts = []
    for difference, its_tasks in tasks_by_difference.items():
        part = difference
        if len(its_tasks) < len(tasks):
            part += f" ({', '.join(its_tasks)})"
        parts.append(part)
    return "; ".join(parts)


def _explicit_differences(policy_run: PolicyRun, cell: Cell) -> Iterator[str]:
    """Yield how a task was played differently than by the paper's policies, a phrase each.

    For example ``split train``, ``12 of 50 episodes`` and ``2 errors``.
    """
    conditions = policy_run.conditions
    environment = conditions.environment
    # Behind the @ stands a hash of the file's words. Only a file with exactly RoboMME's sentences
    # can be opened under its name, so the name is enough.
    if (conditions.wordings or "").partition("@")[0] != ROBOMME_NAME:
        yield words_label(conditions.wordings)
    episodes = TRIALS["main"].episodes
    played = len(cell.by_episode().keys() & set(range(episodes)))
    if conditions.arm != TOLD:
        yield f"arm {conditions.arm}"
    if conditions.split != _SPLIT:
        yield f"split {conditions.split}"
    elif played < episodes:
        yield f"{played} of {counted(episodes, 'episode')}"
    if environment.max_steps != PUBLISHED_MAX_STEPS:
        yield f"{environment.max_steps} steps instead of {PUBLISHED_MAX_STEPS}"
    if environment.meshes != DEFAULT_MESHES:
        yield f"{environment.meshes} meshes"
    if environment.demonstration_frames not in (None, "all"):
        yield f"frames of the video: {environment.demonstration_frames}"
    for mismatch in policy_run.versions.differences(_COMPARABLE):
        yield f"{mismatch.what} {mismatch.first}"
    if cell.errors:
        yield counted(cell.errors, "error")
    if cell.missing:
        yield f"{counted(cell.missing, 'trial')} still to be played"
    if cell.spared:
        yield f"{counted(cell.spared, 'trial')} not played, as it was decided"
