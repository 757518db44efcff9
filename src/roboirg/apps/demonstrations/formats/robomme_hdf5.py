"""Write RoboMME's own format: one HDF5 file per task, a group per time step.

As in RoboMME's files, the observation of a time step is the result of its action, and neither the
robot's way home after the video nor the observation after it is stored.
"""

from __future__ import annotations

import json
import math
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from roboirg.apps.demonstrations.dataset_part import (
    DatasetPart,
    RecordedEpisode,
    RecordedInstructions,
    place_instructions,
)
from roboirg.apps.demonstrations.export_format import ExportFormat
from roboirg.apps.demonstrations.export_plan import ExportedInstruction, ExportPlan
from roboirg.apps.demonstrations.frame_columns import FrameColumns, PlacedInstruction
from roboirg.apps.demonstrations.replayable_trajectory import ReplayableTrajectory
from roboirg.apps.demonstrations.trajectory import (
    Trajectory,
    load_trajectory,
    read_depth,
    read_picture,
)
from roboirg.core.extras import extra_needed
from roboirg.core.observations import CAMERAS
from roboirg.util.atomic_write import replacing

SHARED_FOLDER = "trajectories"
"""Folder of the time steps if several settings refer to them."""
_CLOSED_FINGER = 0.03
_COMPRESSION = {"compression": "gzip", "compression_opts": 1}
"""Of pictures and depth."""
_NO_CHOICE = json.dumps({"choice": "", "point": []})
_FILES = "record_dataset_*.h5"
"""For example record_dataset_PickXtimes.h5."""
_JOINTS = 7
_MME_VLA = """\
```sh
python scripts/build_dataset.py --raw_data_path {root}
uv run scripts/train.py mme_vla_suite --exp-name=perceptual-framesamp-modul \\
    --dataset-path=data/robomme_preprocessed_data --model.use_history \\
    --model.history_config=perceptual-framesamp-modul.yaml \\
    --num-train-steps=80000 --batch-size=64 \\
    --lr-schedule.peak-lr=5e-05 --lr-schedule.decay-lr=5e-05 \\
    --lr-schedule.warmup-steps=10000
```

are MME-VLA's builder, which reads these files as RoboMME's own, and its training.
`waypoint_action` is all NaN, `choice_action` empty and `available_multi_choices` an empty list:
nothing here acts in these spaces. Recording ends with the success, so that no time step
`is_completed`.
"""


def check_hdf5_support() -> None:
    """Check early that HDF5 files can be written and read."""
    with extra_needed("RoboMME's format needs h5py", "demonstrations"):
        import h5py  # noqa: F401


def folder_of(instruction: ExportedInstruction) -> str:
    """Return the name of the folder of a setting and form, such as ``"spatial-implicit"``."""
    return f"{instruction.options.setting}-{instruction.options.form}"


def make_parts(
    plan: ExportPlan, root: Path, recorded: Sequence[RecordedInstructions]
) -> list[DatasetPart]:
    """Divide a dataset into parts, one for each task, as RoboMME has a file for each.

    Args:
        plan: what is exported.
        root: folder of the dataset.
        recorded: its trajectories, with their instructions.
    """
    columns = FrameColumns(plan)
    by_task: dict[str, list[RecordedEpisode]] = {}
    for episode in place_instructions(recorded):
        by_task.setdefault(_task(episode), []).append(episode)
    parts = []
    for number, episodes in enumerate(by_task.values()):
        parts.append(DatasetPart(number, root, columns, tuple(episodes)))
    return parts


def _task(episode: RecordedEpisode) -> str:
    """Return the name of an episode's task."""
    return str(episode.instructions[0].instruction.facts["task"])


def write_part(part: DatasetPart) -> None:
    """Write the demonstrations of one task as RoboMME's HDF5 files.

    With one setting and form, this is the file ``record_dataset_TASK.h5``. With several, each has a
    folder with such a file of its words, whose time steps are links to a common file in
    `SHARED_FOLDER`, as they do not depend on words.
    """
    import h5py

    name = f"record_dataset_{_task(part.episodes[0])}.h5"
    folders = _folders(part)
    is_shared = len(folders) > 1
    steps_folder = part.root / SHARED_FOLDER if is_shared else part.root
    with replacing(steps_folder / name) as path, h5py.File(path, "w") as file:
        for episode in part.episodes:
            _write_episode(file, episode)
    if is_shared:
        for folder in folders:
            with replacing(part.root / folder / name) as path, h5py.File(path, "w") as file:
                for episode in part.episodes:
                    _link_episode(file, episode, folder, f"../{SHARED_FOLDER}/{name}")


def _folders(part: DatasetPart) -> list[str]:
    """Return the folders of a part, each once: one for each setting and form of instructions."""
    folders: dict[str, None] = {}
    for episode in part.episodes:
        for placed in episode.instructions:
            folders[folder_of(placed.instruction)] = None
    return list(folders)


def _write_episode(file: Any, episode: RecordedEpisode) -> None:  # noqa: ANN401
    """Write an episode into an open HDF5 file: its time steps and its first instruction.

    The group is called ``episode_N`` by the number in the split, its steps ``timestep_0`` and so
    on.
    """
    trajectory = load_trajectory(episode.path)
    group = file.create_group(f"episode_{trajectory.facts.episode}")
    _write_setup(group, trajectory, episode.instructions[0])
    with zipfile.ZipFile(episode.path) as archive:
        for step, row in enumerate(time_steps(trajectory)):
            _write_step(group.create_group(f"timestep_{step}"), trajectory, row, archive)


def _link_episode(file: Any, episode: RecordedEpisode, folder: str, home: str) -> None:  # noqa: ANN401
    """Write an episode's words in one setting and form, and links to its time steps.

    Nothing is written if the episode has no instruction in them.

    Args:
        file: open HDF5 file of the setting and form.
        episode: with its instructions.
        folder: name of the setting and form, such as ``"spatial-implicit"``.
        home: path of the file with the time steps, from the folder.
    """
    import h5py

    for placed in episode.instructions:
        if folder_of(placed.instruction) != folder:
            continue
        trajectory = load_trajectory(episode.path)
        name = f"episode_{trajectory.facts.episode}"
        group = file.create_group(name)
        _write_setup(group, trajectory, placed)
        for step in range(len(time_steps(trajectory))):
            group[f"timestep_{step}"] = h5py.ExternalLink(home, f"/{name}/timestep_{step}")


def time_steps(trajectory: Trajectory) -> list[int]:
    """Return the rows of a trajectory that are time steps of RoboMME, in order.

    All but the policy's first observation, whose action, a step at home, RoboMME does not store.
    Video of 3 rows, 2 steps of the policy -> ``[0, 1, 2, 4, 5]``.
    """
    facts = trajectory.facts
    return [row for row in range(facts.frames + 1) if row != facts.video_length]


def _write_setup(group: Any, trajectory: Trajectory, placed: PlacedInstruction) -> None:  # noqa: ANN401
    """Write the group ``setup`` of an episode: seed, difficulty, instruction, camera intrinsics.

    Args:
        group: of HDF5, for the episode.
        trajectory: what the robot did.
        placed: its instruction, with its numbers in the dataset.
    """
    import h5py

    facts = trajectory.facts
    setup = group.create_group("setup")
    setup["seed"] = np.int64(facts.seed)
    setup["difficulty"] = facts.difficulty
    setup.create_dataset("task_goal", data=[placed.instruction.text], dtype=h5py.string_dtype())
    for camera in CAMERAS:
        name = f"{camera}_intrinsic"
        setup[f"{camera}_camera_intrinsic"] = trajectory.calibration[name]
    setup["available_multi_choices"] = "[]"


def _write_step(
    group: Any,  # noqa: ANN401
    trajectory: Trajectory,
    row: int,
    archive: zipfile.ZipFile,
) -> None:
    """Write one time step of a trajectory as RoboMME has it: observation, actions and subgoals.

    Args:
        group: of HDF5, for the time step.
        trajectory: what the robot did.
        row: number of the time step in it.
        archive: the trajectory's open file, with its pictures.
    """
    _write_observation(group.create_group("obs"), trajectory, row, archive)
    done = group.create_group("action")
    done["joint_action"] = trajectory.actions[row]
    done["eef_action"] = trajectory.pose_actions[row]
    done["waypoint_action"] = np.full(7, math.nan)
    done["choice_action"] = _NO_CHOICE
    info = group.create_group("info")
    info["simple_subgoal"] = str(trajectory.subgoals[row])
    info["simple_subgoal_online"] = str(trajectory.online_subgoals[row])
    info["grounded_subgoal"] = str(trajectory.grounded_subgoals[row])
    info["grounded_subgoal_online"] = str(trajectory.grounded_online_subgoals[row])
    info["is_video_demo"] = np.bool_(row < trajectory.facts.video_length)
    info["is_subgoal_boundary"] = np.bool_(_is_boundary(trajectory, row))
    info["is_completed"] = np.bool_(False)


def _write_observation(
    seen: Any,  # noqa: ANN401
    trajectory: Trajectory,
    row: int,
    archive: zipfile.ZipFile,
) -> None:
    """Write what is observed in one time step: pictures, depth, and the robot's state.

    Args:
        seen: group of HDF5.
        trajectory: what the robot did.
        row: number of the time step in it.
        archive: the trajectory's open file, with its pictures.
    """
    for camera in CAMERAS:
        picture = read_picture(archive, camera, row)
        depth = read_depth(archive, camera, row)
        seen.create_dataset(f"{camera}_rgb", data=picture, **_COMPRESSION)
        seen.create_dataset(f"{camera}_depth", data=depth, **_COMPRESSION)
        extrinsic = trajectory.calibration[f"{camera}_extrinsic"][row]
        seen[f"{camera}_camera_extrinsic"] = extrinsic
    fingers = trajectory.gripper[row]
    seen["joint_state"] = trajectory.joint_positions[row]
    seen["eef_state"] = trajectory.end_effector[row].astype(np.float32)
    seen["gripper_state"] = fingers
    seen["is_gripper_close"] = np.bool_((fingers < _CLOSED_FINGER).any())


def _is_boundary(trajectory: Trajectory, row: int) -> bool:
    """Return whether a row is the first of its subgoal among the time steps; see `time_steps`.

    The first time step and the policy's first one always are.
    """
    first_observation = trajectory.facts.video_length  # which is no time step
    if row in (0, first_observation + 1):
        return True
    return bool(trajectory.subgoals[row] != trajectory.subgoals[row - 1])


def training_text(_plan: ExportPlan, root: Path) -> str:
    """Return how to train MME-VLA from a dataset, as Markdown."""
    return _MME_VLA.format(root=root)


def read(path: Path) -> Iterator[ReplayableTrajectory]:
    """Read the trajectories of RoboMME's HDF5 files, ours or its own, to replay them.

    Args:
        path: a folder of files, each of one task, or one such file; of anything else, nothing is
            yielded.
    """
    for file_path in _hdf5_files(path):
        check_hdf5_support()
        import h5py

        task = file_path.stem.removeprefix("record_dataset_")
        with h5py.File(file_path, "r") as file:
            for name in sorted(file, key=_number):
                yield _read_hdf5_episode(file[name], task, name)


def _hdf5_files(path: Path) -> list[Path]:
    """Return the HDF5 files that hold time steps, not links to them; none for other paths."""
    if path.is_file() and path.match(_FILES):
        return [path]
    return sorted(path.glob(_FILES)) or sorted((path / SHARED_FOLDER).glob(_FILES))


def _read_hdf5_episode(group: Any, task: str, name: str) -> ReplayableTrajectory:  # noqa: ANN401
    """Read an episode of a RoboMME file, without the time steps of the video shown before it.

    Args:
        group: of HDF5, for the episode.
        task: its task.
        name: of the episode in the file.

    Returns:
        Actions and states have seven joint angles (rad) and one number for the gripper.
    """
    actions = []
    states = []
    final = None
    names = [name for name in group if name.startswith("timestep_")]
    for step in sorted(names, key=_number):
        entry = group[step]
        action = np.asarray(entry["action/joint_action"][()])
        has_action = action.dtype.kind == "f"  # else it is a text
        if entry["info/is_video_demo"][()] or not has_action:
            continue
        joints = entry["obs/joint_state"][()]
        fingers = entry["obs/gripper_state"][()]
        actions.append(action.astype(np.float64))
        states.append(np.append(joints, fingers[0]).astype(np.float64))
        final = np.append(joints, fingers).astype(np.float64)
    return ReplayableTrajectory(
        name=f"{task}/{name}",
        task=task,
        seed=int(group["setup/seed"][()]),
        split=None,
        index=None,
        actions=np.array(actions).reshape(-1, _JOINTS + 1),
        states=np.array(states).reshape(-1, _JOINTS + 1),
        final_state=final,
        status="success",
    )


def _number(name: str) -> int:
    """Return the number at the end of a group's name."""
    return int(name.rpartition("_")[2])


FORMAT = ExportFormat(
    name="robomme-hdf5",
    begins_with_video=True,
    has_depth=True,
    has_frame_tables=False,
    has_labels=False,
    check_support=check_hdf5_support,
    make_parts=make_parts,
    write_part=write_part,
    training_text=training_text,
    read=read,
)
