"""What every reader hears in every text, with the looks that a body takes at first."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiment.store import Entry, Store
from experiment.study import TRUTH, Study, Trial, body_of, reader_of, show
from roboirg.extension.sight import LOOK_EVERY, shown_to_policy
from roboirg.util.atomic_write import replacing
from roboirg.util.parallel_map import parallel_map
from roboirg_learn.learn_support import check_learn_support
from roboirg_learn.policy.policy_model import FIRST_LOOKS, SEEN_TOGETHER
from roboirg_learn.policy.tracks import Detections
from roboirg_learn.policy.trained_reader import HeardGoal


def hear_missing(study: Study) -> None:
    """Let the reader of each row hear every text that it has not heard.

    The verdict of an entry is what was heard: task and answer.
    """
    folder = study.work / "looks"
    with study.open_store("hearings") as hearings:
        missing = {}
        unseen = {}
        for trial in study.trials():
            if heard_goal(hearings, trial) is None:
                missing[str(trial.hearing_key)] = trial
                if not (folder / trial.looks_name).exists():
                    unseen[trial.looks_name] = trial
        looks = parallel_map(partial(_look, folder), list(unseen.values()), study.workers)
        for done, _ in enumerate(looks, 1):
            show("looks", done, len(unseen))
        for trial in missing.values():
            hearings.add(Entry(dict(trial.hearing_key), " ".join(_hear(folder, trial))))
        print(f"hearings: {len(hearings):,}", flush=True)


def heard_goal(hearings: Store, trial: Trial) -> HeardGoal | None:
    """Return the goal that a row hears in a trial; None if it has not heard it yet."""
    if trial.row.heard == TRUTH:
        return trial.true_goal
    found = hearings.get(trial.hearing_key)
    return None if found is None else HeardGoal(*found.verdict.split(" ", 1))


def _hear(folder: Path, trial: Trial) -> HeardGoal:
    """Return the goal that a row's reader hears with the looks of a folder."""
    with np.load(folder / trial.looks_name) as stored:
        arrays = list(stored.values())
    looks = [Detections(*arrays[start : start + 3]) for start in range(0, len(arrays), 3)]
    return reader_of(trial.row.reader).hear(trial.reported["heard"], looks)


def _look(folder: Path, trial: Trial) -> None:
    """Write what a body finds at first, and in a video two seconds later; runs in workers.

    The detector gets the same pictures together as when the body plays, which decides last bits.
    """
    check_learn_support()
    first, video = shown_to_policy(trial.episode, LOOK_EVERY)
    pictures = list(video[:SEEN_TOGETHER]) if len(video) else [first]
    seen = body_of(trial.row.body).see(pictures)
    arrays: list[NDArray[Any]] = []
    for look in FIRST_LOOKS:
        if look < len(seen):
            arrays += seen[look]
    with replacing(folder / trial.looks_name) as part, part.open("wb") as file:
        np.savez(file, *arrays)
