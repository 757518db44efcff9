"""The plan as CSV: for spreadsheets, and for labs with a control stack of their own."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping

from roboirg.real.study.counterbalancing import arrangement_of
from roboirg.real.study.study_plan import PlannedDemonstration, PlannedTrial, StudyPlan
from roboirg.real.study.trial_text import places_of, turns_of

TRIALS_FILE, DEMONSTRATIONS_FILE = "trials.csv", "demonstrations.csv"
_ARRANGEMENT = ("target_color", "target_side", "left_color", "repeats")


def trials_csv(plan: StudyPlan) -> str:
    """A line for each trial, in order. It names the policies, which the sheet does not."""
    return _text(
        {
            "position": number,
            "trial": trial.name,
            "block": trial.block,
            "policy": trial.job.policy,
            "task": trial.job.task,
            "setting": trial.job.setting,
            "split": trial.job.split,
            "episode": trial.job.episode,
            **_common(trial),
        }
        for number, trial in enumerate(plan.trials, 1)
    )


def demonstrations_csv(plan: StudyPlan) -> str:
    """A line for each demonstration, in order."""
    return _text(
        {
            "position": number,
            "demonstration": one.name,
            "task": one.task,
            "split": one.episode.split,
            "episode": one.number,
            **_common(one),
        }
        for number, one in enumerate(plan.demonstrations, 1)
    )


def _common(planned: PlannedTrial | PlannedDemonstration) -> dict[str, object]:
    arrangement = arrangement_of(planned.episode)
    told = (arrangement.color, arrangement.side, arrangement.left, arrangement.repeats or "")
    return {
        **dict(zip(_ARRANGEMENT, told, strict=True)),
        "places": "; ".join(places_of(planned)),
        "instruction": " ".join(turns_of(planned)),
    }


def _text(rows: Iterable[Mapping[str, object]]) -> str:
    lines = list(rows)
    out = io.StringIO()
    if lines:
        writer = csv.DictWriter(out, list(lines[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(lines)
    return out.getvalue()
