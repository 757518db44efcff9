"""Whether a recorded data set is what the study planned: words, balance, cameras, rate, units."""

from __future__ import annotations

import csv
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from roboirg.apps.demonstrations.picture_coding import FRAME_RATE
from roboirg.apps.demonstrations.teleoperation.teleop_dataset import (
    ACTION,
    PICTURES,
    STATE,
    TeleopDataset,
)
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import CAMERAS
from roboirg.core.plain_text import counted

PLAN_FILE = "demonstrations.csv"
SAID = ("target_color", "repeats")
"""What the words of a demonstration tell, and so the words' numbers balance."""
_FEWEST_FRAMES = 2
_SHOWN = 3
_SLACK = 0.25
"""Share of the gripper's range by which its values may leave it."""


class PlannedTake(NamedTuple):
    """A demonstration of the plan.

    Attributes:
        name: of the demonstration.
        task: name of the task.
        split: of the episode.
        episode: number in the split.
        text: the instruction.
        factors: what the words tell.
    """

    name: str
    task: str
    split: str
    episode: int
    text: str
    factors: Mapping[str, str]


class CheckedRecording(NamedTuple):
    """What a check found.

    Attributes:
        problems: sentences; none if the data set is as planned.
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
                    row["instruction"], {name: row[name] for name in SAID},
                )
                for row in csv.DictReader(file)
            )  # fmt: skip
    except (OSError, KeyError, ValueError) as error:
        raise InvalidValueError(
            f"{path} is no plan of demonstrations ({error}); make one with roboirg real plan."
        ) from error


def check_recording(dataset: TeleopDataset, planned: Sequence[PlannedTake]) -> CheckedRecording:
    """Compare a data set with the plan."""
    texts = [one.text for one in dataset.episodes]
    found = _matched(texts, planned)
    problems = [*_form_problems(dataset), *_word_problems(texts, planned)]
    if not problems:
        problems = list(_value_problems(dataset))
    takes = tuple(one for one in found if one is not None)
    moved = sum(one is not take for one, take in zip(found, planned, strict=False))
    return CheckedRecording(tuple(problems), takes, moved)


def _matched(texts: Sequence[str], planned: Sequence[PlannedTake]) -> list[PlannedTake | None]:
    """Return each text's demonstration: the one at its place, else the first left with the text."""
    found = [
        take if take is not None and take.text == text else None
        for text, take in zip(texts, [*planned, *[None] * len(texts)], strict=False)
    ]
    left = [take for take in planned if take not in found]
    for index, text in enumerate(texts):
        if found[index] is None:
            found[index] = next((take for take in left if take.text == text), None)
            left = [take for take in left if take is not found[index]]
    return found


def _form_problems(dataset: TeleopDataset) -> Iterator[str]:
    """Yield what is wrong with rate, cameras and names."""
    if dataset.info["fps"] != FRAME_RATE:
        yield (
            f"The rate is {dataset.info['fps']} frames per second; the study plays {FRAME_RATE}: "
            f"record with --dataset.fps={FRAME_RATE}."
        )
    for camera in CAMERAS:
        name = getattr(dataset.names, camera)
        if name not in dataset.cameras:
            yield (
                f"There is no {camera} camera {name!r}; the data set has "
                f"{', '.join(dataset.cameras) or 'none'}. Record it, or name it: "
                f"{dataset.root}?{camera}=NAME."
            )
    for feature in (STATE, ACTION):
        has = dataset.columns(feature)
        lacking = [one for one in (*dataset.names.joints, dataset.names.gripper) if one not in has]
        if lacking:
            yield (
                f"{feature} has no {', '.join(lacking)}; it has {', '.join(has) or 'no names'}. "
                f"Other names: {dataset.root}?joint=NAME{{}}&gripper=NAME."
            )


def _word_problems(texts: Sequence[str], planned: Sequence[PlannedTake]) -> Iterator[str]:
    """Yield what is wrong with words and balance."""
    by_text = {take.text: take for take in planned}
    unknown = [f"{index} ({text!r})" for index, text in enumerate(texts) if text not in by_text]
    if unknown:
        yield (
            f"The plan has no demonstration with the words of "
            f"{counted(len(unknown), 'episode')}: {_some(unknown)}."
        )
    recorded = [by_text[text] for text in texts if text in by_text]
    unbalanced = False
    for task in dict.fromkeys(take.task for take in planned):
        for factor in SAID:
            counts, wanted = (
                Counter(one.factors[factor] for one in takes if one.task == task)
                for takes in (recorded, planned)
            )
            if counts != wanted:
                unbalanced = True
                yield f"{task} has {factor} {_counts(counts)}; the plan has {_counts(wanted)}."
    by_words, wanted_words = Counter(texts), Counter(take.text for take in planned)
    differing = [text for text, count in wanted_words.items() if by_words[text] != count]
    if differing and not unbalanced:
        listed = [f"{one!r} {by_words[one]} of {wanted_words[one]} times" for one in differing]
        yield f"Words are not as often as planned: {_some(listed)}."
    missing = [take.name for take in planned if take not in _matched(texts, planned)]
    if missing:
        yield f"Not recorded: {_some(missing)}."


def _value_problems(dataset: TeleopDataset) -> Iterator[str]:
    """Yield what is wrong with lengths and numbers."""
    names = dataset.names
    for one in dataset.episodes:
        if one.length < _FEWEST_FRAMES:
            yield f"Episode {one.number} has {counted(one.length, 'frame')}."
            continue
        for feature in (STATE, ACTION):
            values = dataset.vectors(one, feature)
            if not np.isfinite(values).all():
                yield f"Episode {one.number}: {feature} is not finite."
            elif np.abs(values[:, :-1]).max() / names.unit > 2 * math.pi:
                yield (
                    f"Episode {one.number}: a joint of {feature} is beyond a whole turn; if joints "
                    f"are in degrees, say {dataset.root}?degrees=true."
                )
            elif np.abs(names.opening(values[:, -1]) - 0.5).max() > 0.5 + _SLACK:
                yield (
                    f"Episode {one.number}: the gripper of {feature} is from "
                    f"{values[:, -1].min():g} to {values[:, -1].max():g}; closed is "
                    f"{names.gripper_closed:g} and open {names.gripper_open:g}, or say "
                    f"{dataset.root}?gripper_closed=…&gripper_open=…."
                )
    for camera in CAMERAS:
        if dataset.info["features"][PICTURES + getattr(names, camera)]["shape"][-1] != len("RGB"):
            yield f"The pictures of the {camera} camera are not RGB."


def _counts(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{name or 'none'} {counts[name]}" for name in sorted(counts)) or "nothing"


def _some(entries: Sequence[str]) -> str:
    more = len(entries) - _SHOWN
    return ", ".join(entries[:_SHOWN]) + (f" and {more} more" if more > 0 else "")
