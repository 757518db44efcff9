"""Whether a recorded dataset is what the study planned: words, balance, cameras, rate, units."""

from __future__ import annotations

import csv
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import NamedTuple

import numpy as np

from roboirg.apps.demonstrations.teleoperation.teleop_dataset import ACTION, STATE, TeleopDataset
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import CAMERAS
from roboirg.util.media import CONTROL_RATE

PLAN_FILE = "demonstrations.csv"
FACTORS = ("target_color", "repeats")
"""What the words of a demonstration say; sides can be planned, but not be checked."""
_SHOWN = 3
_SLACK = 0.25
"""Share of the gripper's range by which its values may leave it."""


class PlannedTake(NamedTuple):
    """A demonstration of the plan: its episode, its instruction, and what that says."""

    name: str
    task: str
    split: str
    episode: int
    text: str
    factors: Mapping[str, str]


class CheckedRecording(NamedTuple):
    """What a check found.

    Attributes:
        problems: sentences; none if the dataset is as planned.
        takes: the demonstration of each episode, in the order of the episodes.
        moved: how many were not recorded in the planned order.
    """

    problems: tuple[str, ...]
    takes: tuple[PlannedTake, ...]
    moved: int


def read_takes(study: Path) -> tuple[PlannedTake, ...]:
    """Return the demonstrations of a study.

    Raises:
        InvalidValueError: the folder has no plan of demonstrations.
    """
    path = study / PLAN_FILE
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return tuple(
                PlannedTake(
                    row["demonstration"], row["task"], row["split"], int(row["episode"]),
                    row["instruction"], {name: row[name] for name in FACTORS},
                )
                for row in csv.DictReader(file)
            )  # fmt: skip
    except (OSError, KeyError, ValueError) as error:
        raise InvalidValueError(
            f"{path} is no plan of demonstrations ({error}); make one with roboirg real plan."
        ) from error


def check_recording(dataset: TeleopDataset, planned: Sequence[PlannedTake]) -> CheckedRecording:
    """Compare a dataset with the plan."""
    takes = _matched(dataset.texts, planned)
    problems = [*_form_problems(dataset), *_word_problems(dataset.texts, planned)]
    problems = problems or list(_value_problems(dataset))
    moved = sum(one is not take for one, take in zip(takes, planned, strict=False))
    return CheckedRecording(tuple(problems), takes, moved)


def _matched(texts: Sequence[str], planned: Sequence[PlannedTake]) -> tuple[PlannedTake, ...]:
    """Return for each text that has one the demonstration at its place, or the first one left."""
    left, found = list(planned), []
    for text, here in zip_longest(texts, planned[: len(texts)]):
        fitting = [take for take in left if take.text == text]
        if fitting:
            found.append(here if here in fitting else fitting[0])
            left.remove(found[-1])
    return tuple(found)


def _form_problems(dataset: TeleopDataset) -> Iterator[str]:
    """Yield what is wrong with rate, cameras and names."""
    rate, root = dataset.info["fps"], dataset.root
    if rate != CONTROL_RATE:
        yield f"The rate is {rate} frames per second, but the study plays {CONTROL_RATE}."
    for camera in CAMERAS:
        if (name := getattr(dataset.names, camera)) not in dataset.cameras:
            yield (
                f"There is no {camera} camera {name!r}; the dataset has "
                f"{', '.join(dataset.cameras) or 'none'}. Name it: {root}?{camera}=NAME."
            )
    for feature in (STATE, ACTION):
        has = dataset.columns(feature)
        if lacking := [one for one in dataset.names.vector if one not in has]:
            yield (
                f"{feature} has no {', '.join(lacking)}; it has {', '.join(has) or 'no names'}. "
                f"Name them: {root}?joint=NAME{{}}&gripper=NAME."
            )


def _word_problems(texts: Sequence[str], planned: Sequence[PlannedTake]) -> Iterator[str]:
    """Yield what is wrong with words and balance."""
    by_text = {take.text: take for take in planned}
    recorded = [by_text[text] for text in texts if text in by_text]
    for task in dict.fromkeys(take.task for take in planned):
        for factor in FACTORS:
            has, wanted = (
                Counter(one.factors[factor] for one in takes if one.task == task)
                for takes in (recorded, planned)
            )
            if has != wanted:
                yield f"{task} has {factor} {_counts(has)}; the plan has {_counts(wanted)}."
    said, to_say = Counter(texts), Counter(take.text for take in planned)
    differing = [
        f"{text!r} {said[text]} instead of {to_say[text]} times"
        for text in dict.fromkeys([*texts, *to_say])
        if said[text] != to_say[text]
    ]
    if differing:
        more = len(differing) - _SHOWN
        end = f" and {more} more" if more > 0 else ""
        yield f"The words are not the plan's: {', '.join(differing[:_SHOWN])}{end}."


def _value_problems(dataset: TeleopDataset) -> Iterator[str]:
    """Yield what is wrong with lengths and numbers."""
    names, root = dataset.names, dataset.root
    for index, episode in enumerate(dataset.episodes):
        if episode["length"] == 1:
            yield f"Episode {index} has a single frame."
        for feature in (STATE, ACTION):
            values = dataset.vectors(index, feature)
            grips = values[:, -1]
            if not np.isfinite(values).all():
                yield f"Episode {index}: {feature} is not finite."
            elif np.abs(values[:, :-1]).max() / names.unit > 2 * math.pi:
                yield f"Episode {index}: {feature} is beyond a turn; degrees? {root}?degrees=true"
            elif np.abs(names.opening(grips) - 0.5).max() > 0.5 + _SLACK:
                yield (
                    f"Episode {index}: the gripper of {feature} is from {grips.min():g} to "
                    f"{grips.max():g}; say {root}?gripper_closed=NUMBER&gripper_open=NUMBER."
                )


def _counts(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{name or 'none'} {counts[name]}" for name in sorted(counts)) or "nothing"
