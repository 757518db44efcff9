"""Whether a rate can be compared with the published one of its cell, and what differs if not.

Only the explicit setting can be repeated: its episodes are RoboMME's test episodes and its words
RoboMME's, which a wording file brings. The paper's implicit instructions are not published.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from roboirg.core.arms import TOLD
from roboirg.core.environment_options import DEFAULT_MESHES
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.plain_text import counted
from roboirg.core.word_pools import ROBOMME_NAME, words_label
from roboirg.evaluation.analysis.published import MAX_STEPS, TRIALS, published_tasks
from roboirg.evaluation.analysis.results.frame import RunNames
from roboirg.evaluation.analysis.results.policy_run import PolicyRun
from roboirg.evaluation.analysis.stats.cells import Cell, CellKey
from roboirg.language.settings import EXPLICIT

Differences = tuple[str, ...]
"""What differs from the published rate; empty if the two can be compared."""
AllDifferences = Mapping[CellKey, Differences | None]
"""The differences of cells; None where there is nothing to compare."""

IMPLICIT: Differences = ("the paper's instructions are not published",)
REAL: Differences = ("the paper's own robot",)

COMPARABLE_SIGN = "="
DIFFERENT_SIGN = "≠"

_SPLIT = "test"


def differences_of(key: CellKey, cell: Cell) -> Differences | None:
    """Return what differs between a cell and the published rate of that cell.

    The number of policy seeds makes no difference, nor does it matter what the policy is.

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
    """Return what differs in an average of cells; None if one of them cannot be compared."""
    found: list[str] = []
    for one in differences:
        if one is None:
            return None
        found += one
    return tuple(dict.fromkeys(found))


def comparison_sign(differences: Differences | None) -> str:
    """Return the sign of a rate; none if no rate of its kind could be compared."""
    if differences is None or differences in (IMPLICIT, REAL):
        return ""
    return DIFFERENT_SIGN if differences else COMPARABLE_SIGN


def comparison_notes(found: AllDifferences, names: RunNames) -> list[str]:
    """Return sentences that explain the signs and say what differs, by policy and task."""
    cells = {key: one for key, one in found.items() if comparison_sign(one)}
    notes = []
    if () in cells.values():
        notes.append(
            f"{COMPARABLE_SIGN} comparable with the published rate: RoboMME's test episodes, "
            "words, step limit and world."
        )
    policy_runs = list(dict.fromkeys(key.policy_run for key in cells))
    by_text: dict[str, list[PolicyRun]] = {}
    for policy_run in policy_runs:
        own = {key.task: one or () for key, one in cells.items() if key.policy_run == policy_run}
        by_text.setdefault(_text(own), []).append(policy_run)
    for text, those in by_text.items():
        if text:
            who = "" if those == policy_runs else f" ({'; '.join(names[one] for one in those)})"
            notes.append(f"{DIFFERENT_SIGN} not comparable with the published rate{who}: {text}.")
    for never, subject in ((IMPLICIT, "Implicit settings are"), (REAL, "These rates are")):
        if never in found.values():
            notes.append(f"{subject} not comparable with the published rates: {never[0]}.")
    return notes


def _text(tasks: Mapping[str, Differences]) -> str:
    """Return what differs, with the tasks in which it does unless these are all."""
    found: dict[str, list[str]] = {}
    for task, differences in tasks.items():
        for difference in differences:
            found.setdefault(difference, []).append(task)
    parts = []
    for difference, where in found.items():
        named = "" if len(where) == len(tasks) else f" ({', '.join(where)})"
        parts.append(difference + named)
    return "; ".join(parts)


def _explicit_differences(policy_run: PolicyRun, cell: Cell) -> Iterator[str]:
    conditions = policy_run.conditions
    versions = policy_run.versions
    environment = conditions.environment
    # Only a file with exactly RoboMME's sentences can be opened under its name.
    if (conditions.wordings or "").partition("@")[0] != ROBOMME_NAME:
        yield words_label(conditions.wordings)
    episodes = range(TRIALS["main"][0])
    played = len(cell.by_episode().keys() & set(episodes))
    if conditions.arm != TOLD:
        yield f"arm {conditions.arm}"
    if conditions.split != _SPLIT:
        yield f"split {conditions.split}"
    elif played < len(episodes):
        yield f"{played} of {counted(len(episodes), 'episode')}"
    if environment.max_steps != MAX_STEPS:
        yield f"{environment.max_steps} steps instead of {MAX_STEPS}"
    if environment.meshes != DEFAULT_MESHES:
        yield f"{environment.meshes} meshes"
    if environment.demonstration_frames not in (None, "all"):
        yield f"frames of the video: {environment.demonstration_frames}"
    if versions.environment_version not in (None, ENVIRONMENT_VERSION):
        yield f"environment version {versions.environment_version}"
    if cell.errors:
        yield counted(cell.errors, "error")
    if cell.missing:
        yield f"{counted(cell.missing, 'trial')} still to be played"
