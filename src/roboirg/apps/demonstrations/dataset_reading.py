"""Read the states and actions of a dataset, whatever its format, without its pictures."""

from __future__ import annotations

from pathlib import Path

from roboirg.apps.demonstrations.export_format import export_formats
from roboirg.apps.demonstrations.replayable_trajectory import ReplayableTrajectory
from roboirg.core.errors import InvalidValueError


def read_dataset(path: Path) -> list[ReplayableTrajectory]:
    """Read the trajectories of an exported dataset, to replay them; each comes once.

    It may be in the dataset several times, with different instructions.

    Args:
        path: folder of an export, or of RoboMME's HDF5 files, or one of these files.

    Raises:
        InvalidValueError: the path holds no dataset that can be read.
        MissingDependencyError: a package is not installed.
    """
    for file_format in export_formats().values():
        trajectories = list(file_format.read(path))
        if trajectories:
            return trajectories
    raise InvalidValueError(
        f"{str(path)!r} holds no dataset: neither a complete export of ours nor RoboMME's "
        "files record_dataset_TASK.h5."
    )
