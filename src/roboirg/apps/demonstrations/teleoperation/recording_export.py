"""Convert a recorded dataset into the trainers' formats, by way of our trajectories."""

from __future__ import annotations

import functools
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.demonstrations.export_plan import (
    TELEOPERATED,
    ExportPlan,
    RecordingJob,
    TaskText,
    texts_of,
)
from roboirg.apps.demonstrations.export_run import (
    ExportSummary,
    Report,
    TrajectorySource,
    run_export,
)
from roboirg.apps.demonstrations.teleoperation.recording_check import PlannedTake
from roboirg.apps.demonstrations.teleoperation.teleop_dataset import ACTION, STATE, TeleopDataset
from roboirg.apps.demonstrations.trajectory import TrajectoryFacts, write_arrays
from roboirg.apps.demonstrations.trajectory_recorder import PictureTracks, RecordingSpec
from roboirg.core.actions import ARM_JOINTS
from roboirg.core.episode import ENVIRONMENT_VERSION, Episode
from roboirg.core.errors import InvalidValueError
from roboirg.core.kinematics import end_effector_pose
from roboirg.core.observations import CAMERAS
from roboirg.language.settings import EXPLICIT
from roboirg.policies.lerobot_features import FINGER_RANGE, scaled_square
from roboirg.util.atomic_write import replacing
from roboirg.util.short_hash import short_hash


def export_recording(
    dataset: TeleopDataset,
    takes: Sequence[PlannedTake],
    out: Path,
    data_format: str,
    workers: int,
    report: Report,
) -> ExportSummary:
    """Write a checked dataset in a trainer's format; see `run_export`.

    Args:
        dataset: the recording.
        takes: the demonstration of each of its episodes.
        out: folder of the new dataset.
        data_format: its name, as in a plan.
        workers: processes; 0 uses this one.
        report: called with the progress.
    """
    plan = ExportPlan(
        tasks=tuple(dict.fromkeys(one.task for one in takes)),
        split=takes[0].split,
        episodes=tuple(sorted({one.episode for one in takes})),
        settings=(EXPLICIT,),
        format=cast("Any", data_format),
        names="openpi" if data_format == "lerobot-v2.1" else "lerobot",
        policy=f"{TELEOPERATED} {short_hash(repr(dataset))}",
    ).validated()
    spec = RecordingSpec()
    jobs = [
        RecordingJob(take.task, take.split, take.episode, 0, TELEOPERATED, None, spec)
        for take in takes
    ]
    said = [_texts(plan, job.episode, take) for job, take in zip(jobs, takes, strict=True)]
    numbers = {job: index for index, job in enumerate(jobs)}
    convert = functools.partial(_convert, dataset, numbers)
    source = TrajectorySource(list(zip(jobs, said, strict=True)), convert)
    return run_export(plan, out, workers, report, source=source)


def _texts(plan: ExportPlan, episode: Episode, take: PlannedTake) -> tuple[TaskText, ...]:
    """Return the instruction; raises InvalidValueError if this version words it differently."""
    (said,) = texts_of(plan, episode)
    if said.text != take.text:
        raise InvalidValueError(
            f"{take.name} was planned as {take.text!r}, which this version words as "
            f"{said.text!r}; convert with the version that planned the study."
        )
    return (said,)


def _convert(
    dataset: TeleopDataset, numbers: Mapping[RecordingJob, int], folder: Path, job: RecordingJob
) -> None:
    """Write the trajectory of one episode.

    Its last action has no observation that it led to, and is left out.
    """
    index = numbers[job]
    with replacing(job.path(folder)) as part, zipfile.ZipFile(part, "w") as archive:
        tracks = PictureTracks(archive, job.spec)
        streams = [dataset.pictures(index, getattr(dataset.names, one)) for one in CAMERAS]
        for front, wrist in zip(*streams, strict=True):
            seen = {"front_rgb": scaled_square(front), "wrist_rgb": scaled_square(wrist)}
            tracks.add(seen, is_video=False)
        arrays = _arrays(dataset, index)
        arrays |= {f"{one}_histogram": counts for one, counts in tracks.histograms.items()}
        write_arrays(archive, _facts(job, len(arrays["actions"]) - 1), arrays)


def _facts(job: RecordingJob, steps: int) -> TrajectoryFacts:
    return TrajectoryFacts(
        task=job.task, split=job.split, episode=job.number, seed=job.episode.seed,
        difficulty=job.episode.difficulty, variation=0, policy=job.policy, status="success",
        cause="", video_length=0, steps=steps, demonstration_source="none",
        environment_version=ENVIRONMENT_VERSION, coding=job.spec.coding, depth=False,
    )  # fmt: skip


def _arrays(dataset: TeleopDataset, index: int) -> dict[str, NDArray[Any]]:
    """Return the arrays of a trajectory in our units; subgoals have no words."""
    names = dataset.names
    states, aims = (dataset.vectors(index, one) for one in (STATE, ACTION))
    joints = states[:, :ARM_JOINTS] / names.unit
    openings = names.opening(states[:, ARM_JOINTS]).clip(0, 1)
    # A row's action led to its observation: the first comes from holding still.
    aims = np.vstack([states[0], aims[:-1]])
    grips = 2 * names.opening(aims[:, ARM_JOINTS]).clip(0, 1) - 1
    actions = np.column_stack([aims[:, :ARM_JOINTS] / names.unit, grips]).astype(np.float32)
    found: dict[str, NDArray[Any]] = {
        "joint_positions": joints.astype(np.float32),
        "gripper": np.repeat(openings[:, None] * FINGER_RANGE, 2, axis=1).astype(np.float32),
        "end_effector": _poses(joints),
        "actions": actions.astype(np.float64),
        "pose_actions": np.column_stack([_poses(actions[:, :ARM_JOINTS]), actions[:, ARM_JOINTS]]),
    }
    nothing = np.full(len(joints), "")
    kinds = ("", "online_", "grounded_", "grounded_online_")
    return found | {f"{kind}subgoals": nothing for kind in kinds}


def _poses(joints: NDArray[Any]) -> NDArray[np.float64]:
    """Return the tool's poses (rows, 6) with unwrapped angles."""
    poses = np.stack([end_effector_pose(one) for one in joints])
    poses[:, 3:] = np.unwrap(poses[:, 3:], axis=0)
    return poses
