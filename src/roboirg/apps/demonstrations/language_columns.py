"""LeRobot's language columns (0.6 and later): subtasks, other wordings and utterances in time."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any

from roboirg.apps.demonstrations.frame_columns import FrameColumns, PlacedText
from roboirg.apps.demonstrations.trajectory import Trajectory
from roboirg.core.delivery import utterance_steps
from roboirg.core.instruction_options import DEFAULT_DELIVERY
from roboirg.util.media import CONTROL_RATE

PERSISTENT, EVENTS = "language_persistent", "language_events"
LANGUAGE_FEATURES: dict[str, dict[str, Any]] = {
    name: {"dtype": "language", "shape": [1], "names": None} for name in (PERSISTENT, EVENTS)
}
"""What ``info.json`` says of the columns."""


def language_arrays(
    columns: FrameColumns, trajectory: Trajectory, placed: PlacedText
) -> dict[str, Any]:
    """Return both columns of an episode.

    ``language_persistent`` holds each subgoal (style ``subtask``) from its first frame on, and the
    explicit text (``task_aug``); ``language_events`` each later utterance (``interjection``) of an
    instruction that is delivered in turns.
    """
    import pyarrow as pa

    length = len(columns.rows(trajectory.facts))
    persistent = list(_persistent(columns, trajectory, placed))
    events: list[list[dict[str, Any]]] = [[] for _ in range(length)]
    for frame, text in _utterances(columns, trajectory, placed):
        if frame < length:
            events[frame].append(_entry("user", text, "interjection"))
    row = [
        ("role", pa.string()),
        ("content", pa.string()),
        ("style", pa.string()),
        ("camera", pa.string()),
        ("tool_calls", pa.list_(pa.string())),
    ]
    timed = pa.struct([*row[:3], ("timestamp", pa.float32()), *row[3:]])
    return {
        PERSISTENT: pa.array([persistent] * length, pa.list_(timed)),
        EVENTS: pa.array(events, pa.list_(pa.struct(row))),
    }


def _persistent(
    columns: FrameColumns, trajectory: Trajectory, placed: PlacedText
) -> Iterator[dict[str, Any]]:
    words = placed.words
    if words.facts["explicit"] != words.text:
        yield _entry("user", words.facts["explicit"], "task_aug", 0.0)
    frame = 0
    for subgoal, group in itertools.groupby(columns.texts(trajectory)["subgoal"]):
        yield _entry("assistant", subgoal, "subtask", frame / CONTROL_RATE)
        frame += len(list(group))


def _utterances(
    columns: FrameColumns, trajectory: Trajectory, placed: PlacedText
) -> Iterator[tuple[int, str]]:
    """Yield the frame and the text of each utterance after the first, if it is said later."""
    words = placed.words
    if words.options.delivery == DEFAULT_DELIVERY or columns.is_video_part:
        return
    turns = [turn["text"] for turn in words.facts["turns"]]
    first = trajectory.facts.video_length - columns.rows(trajectory.facts).start
    steps = utterance_steps(len(turns), words.options.delivery)
    for step, text in list(zip(steps, turns, strict=True))[1:]:
        yield first + step, text


def _entry(role: str, text: str, style: str, timestamp: float | None = None) -> dict[str, Any]:
    entry = {"role": role, "content": text, "style": style, "camera": None, "tool_calls": None}
    return entry if timestamp is None else entry | {"timestamp": timestamp}
