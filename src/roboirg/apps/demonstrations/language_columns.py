"""LeRobot's language columns, from which its recipes make texts to train on."""

from __future__ import annotations

from typing import Any

from roboirg.apps.demonstrations.frame_columns import LANGUAGE_COLUMNS, PlacedInstruction
from roboirg.apps.demonstrations.trajectory import Trajectory
from roboirg.util.media import CONTROL_RATE


def language_columns(trajectory: Trajectory, placed: PlacedInstruction) -> dict[str, Any]:
    """Return the language columns of an episode: in each frame, rows of what is said.

    A row has who speaks (role), what (content), its kind (style), and a camera and calls of tools,
    which are empty here. Every frame has all subgoals of the robot, each with the time in seconds
    from when it is pursued. The first frame of the policy's turn has the instruction, in one row,
    as LeRobot refuses to choose between rows of equal role and style.
    """
    import pyarrow as pa

    facts = trajectory.facts
    subgoals = []
    last = None
    for frame, subgoal in enumerate(trajectory.subgoals[1:].tolist()):
        if subgoal != last:
            subgoals.append({
                "role": "assistant",
                "content": subgoal,
                "style": "subtask",
                "timestamp": frame / CONTROL_RATE,
            })  # fmt: skip
        last = subgoal
    events: list[object] = [[]] * facts.frames
    events[facts.video_length] = [{"role": "user", "content": placed.instruction.text}]

    text = pa.string()
    row_begin = [("role", text), ("content", text), ("style", text)]
    row_end = [("camera", text), ("tool_calls", pa.list_(text))]
    timed_row = pa.struct([*row_begin, ("timestamp", pa.float32()), *row_end])
    columns = (
        pa.array([subgoals] * facts.frames, pa.list_(timed_row)),
        pa.array(events, pa.list_(pa.struct([*row_begin, *row_end]))),
    )
    return dict(zip(LANGUAGE_COLUMNS, columns, strict=True))
