"""Parts of a dataset, each written at once from recorded trajectories."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from roboirg.apps.demonstrations.export_plan import ORACLE, ExportedInstruction
from roboirg.apps.demonstrations.frame_columns import FrameColumns, PlacedInstruction
from roboirg.apps.demonstrations.parquet_tables import write_rows
from roboirg.apps.demonstrations.trajectory import (
    Trajectory,
    TrajectoryFacts,
    load_facts,
    load_trajectory,
)
from roboirg.core.instruction_options import InstructionOptions

CHUNK_SIZE = 1000
"""Files in a folder."""


class RecordedEpisode(NamedTuple):
    """A trajectory and its instructions.

    Attributes:
        path: of the trajectory's file.
        instructions: each with its place in the dataset.
    """

    path: Path
    instructions: tuple[PlacedInstruction, ...]


class FilePlace(NamedTuple):
    """Numbers of a folder, called chunk, and of a file in it."""

    chunk: int
    file: int


@dataclass(frozen=True)
class DatasetPart:
    """What is written at once; a part that is complete is never written again.

    Attributes:
        number: of the part in its dataset.
        root: folder of the dataset.
        columns: of its frames.
        episodes: of the part.
    """

    number: int
    root: Path
    columns: FrameColumns
    episodes: tuple[RecordedEpisode, ...]

    @property
    def place(self) -> FilePlace:
        """Numbers of the folder and of the file in it."""
        return FilePlace(*divmod(self.number, CHUNK_SIZE))


class RecordedInstructions(NamedTuple):
    """A trajectory and its instructions, which have no place yet."""

    path: Path
    instructions: tuple[ExportedInstruction, ...]


def place_instructions(recorded: Sequence[RecordedInstructions]) -> list[RecordedEpisode]:
    """Give every instruction of a trajectory the numbers that LeRobot has for an episode.

    An episode of the dataset is a trajectory with one of its instructions. So a trajectory of 90
    frames with two instructions makes the episodes 0 and 1, whose first frames have the numbers 0
    and 90. Equal texts have the same task index. Trajectories without frames are left out. Numbers
    follow the order of `recorded`, and no number is left out.
    """
    task_indices: dict[str, int] = {}
    episode_index = 0
    first_index = 0
    episodes = []
    for path, instructions in recorded:
        length = load_facts(path).frames
        if not length:
            continue
        placed = []
        for instruction in instructions:
            task_index = task_indices.setdefault(instruction.text, len(task_indices))
            placed.append(PlacedInstruction(instruction, episode_index, first_index, task_index))
            episode_index += 1
            first_index += length
        episodes.append(RecordedEpisode(path, tuple(placed)))
    return episodes


def all_texts(parts: Sequence[DatasetPart]) -> list[str]:
    """Return the distinct texts of all instructions, in the order of their task indices from 0.

    The indices are those of `place_instructions`, which have no gaps.
    """
    text_by_index = {}
    for part in parts:
        for episode in part.episodes:
            for placed in episode.instructions:
                text_by_index[placed.task_index] = placed.instruction.text
    return [text_by_index[index] for index in range(len(text_by_index))]


def read_episodes(
    parts: Sequence[DatasetPart],
) -> Iterator[tuple[DatasetPart, RecordedEpisode, Trajectory]]:
    """Yield every trajectory of the parts, without pictures."""
    for part in parts:
        for episode in part.episodes:
            yield part, episode, load_trajectory(episode.path)


def episode_row(trajectory: Trajectory, placed: PlacedInstruction) -> dict[str, Any]:
    """Return what is known of an episode: a row of the table of facts next to the dataset.

    Args:
        trajectory: what the robot did.
        placed: the episode's instruction, with its numbers in the dataset.
    """
    facts = trajectory.facts
    instruction = placed.instruction
    final_joints = trajectory.joint_positions[-1].tolist()
    final_fingers = trajectory.gripper[-1].tolist()
    return {
        "episode_index": placed.episode_index,
        "from_index": placed.first_index,
        "length": facts.frames,
        "video_length": facts.video_length,
        "steps": facts.steps,
        "status": facts.status,
        "cause": facts.cause,
        "policy": facts.policy,
        "variation": facts.variation,
        "actions": facts.actions,
        "disturbed": facts.disturbed,
        "trajectory": _trajectory_name(facts, instruction.options),
        "final_state": final_joints + final_fingers,
        "demonstration_source": facts.demonstration_source,
        "environment_version": facts.environment_version,
        "delivery": instruction.options.delivery,
        **instruction.facts,
    }


def write_episode_table(root: Path, parts: Sequence[DatasetPart]) -> None:
    """Write the table of a dataset's episodes, which every format has; see `episode_row`."""
    rows = []
    for _, episode, trajectory in read_episodes(parts):
        rows += [episode_row(trajectory, placed) for placed in episode.instructions]
    write_rows(root / EPISODE_TABLE, rows)


def _trajectory_name(facts: TrajectoryFacts, options: InstructionOptions) -> str:
    """Return a name that all instructions of a trajectory share; only the oracle's has several."""
    name = f"{facts.task}/{facts.split}/{facts.episode}/{facts.variation}"
    if facts.policy == ORACLE:
        return name
    return f"{name}/{options.setting}-{options.form}"


EPISODE_TABLE = "meta/demonstrations.parquet"
"""Path of the table of facts in a dataset."""
