"""Write a plan as CSV, for spreadsheets and for labs with their own control software."""

from __future__ import annotations

from roboirg.apps.real.study.arrangement_shapes import describe_positions
from roboirg.apps.real.study.counterbalancing import read_arrangement
from roboirg.apps.real.study.study_plan import PlannedDemonstration, PlannedTrial, StudyPlan
from roboirg.util.csv_text import csv_text

TRIALS_FILE = "trials.csv"
DEMONSTRATIONS_FILE = "demonstrations.csv"


def trials_csv(plan: StudyPlan) -> str:
    """Return a row for each trial, in order. The rows name the policies, unlike the sheet."""
    return csv_text(
        {
            "position": number,
            "trial": trial.name,
            "block": trial.block,
            "policy": trial.job.policy,
            "task": trial.job.task,
            "setting": trial.job.setting,
            "split": trial.job.split,
            "episode": trial.job.episode,
            **_common_columns(trial),
        }
        for number, trial in enumerate(plan.trials, 1)
    )


def demonstrations_csv(plan: StudyPlan) -> str:
    """Return a row for each demonstration, in order."""
    return csv_text(
        {
            "position": number,
            "demonstration": demonstration.name,
            "task": demonstration.task,
            "split": demonstration.episode.split,
            "episode": demonstration.number,
            **_common_columns(demonstration),
        }
        for number, demonstration in enumerate(plan.demonstrations, 1)
    )


def _common_columns(planned: PlannedTrial | PlannedDemonstration) -> dict[str, object]:
    """Return the columns that say what is arranged and spoken."""
    arrangement = read_arrangement(planned.episode)
    return {
        "target_color": arrangement.color,
        "target_side": arrangement.side,
        "left_color": arrangement.left,
        "repeats": arrangement.repeats or "",
        "places": "; ".join(describe_positions(planned.episode.scene)),
        "instruction": " ".join(planned.turns),
    }
