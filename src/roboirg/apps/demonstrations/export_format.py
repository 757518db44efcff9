"""A format of datasets: what it can carry, how its files are written and read.

A file in `formats/` that defines ``FORMAT`` is a format. Installed packages add theirs through
entry points of the group ``roboirg.export_formats``.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from roboirg.core.errors import check_names
from roboirg.util.discovery import discover


@dataclass(frozen=True, kw_only=True)
class ExportFormat:
    """A format of datasets.

    Attributes:
        name: as in the command line.
        make_parts: returns the parts of a dataset in order: a `DatasetPart` for each file or so.
            It is called with the `ExportPlan`, the folder of the dataset and the trajectories, each
            a `RecordedInstructions`.
        write_part: writes the frames of a part; runs in a worker process.
        finish: writes what describes a dataset, whose last file makes it readable, besides the
            table of episodes, which every dataset gets. It is called with the folder and all parts.
        training_text: returns what to do with a dataset, as Markdown. It is called with the plan
            and the absolute path of the folder.
        read: yields each trajectory of the dataset at a path as a `ReplayableTrajectory`; none if
            the path holds no dataset of this format.
        check_support: raises a `MissingDependencyError` if a library is missing that it needs.
        begins_with_video: whether the task's video is exported unless a plan says otherwise.
        has_depth: whether it holds depth and calibration, and therefore always the pictures of both
            cameras, in full size and without loss.
        has_frame_tables: whether its frames are tables below ``data/``, which Hugging Face reads.
        has_language: whether a frame can hold LeRobot's language columns.
        has_labels: whether a frame can hold an action to learn next to the one that was executed.
        has_waypoints: whether a frame may be a waypoint.
        is_for_openpi: whether its tables with PNGs are openpi's: with its names, and the pictures
            of both cameras in full size.
    """

    name: str
    make_parts: Callable[..., list[Any]]
    write_part: Callable[[Any], None]
    training_text: Callable[..., str]
    read: Callable[[Path], Iterable[Any]]
    finish: Callable[..., None] = lambda _root, _parts: None
    check_support: Callable[[], None] = lambda: None
    begins_with_video: bool = False
    has_depth: bool = False
    has_frame_tables: bool = True
    has_language: bool = False
    has_labels: bool = True
    has_waypoints: bool = False
    is_for_openpi: bool = False


@functools.cache
def export_formats() -> Mapping[str, ExportFormat]:
    """Return every format by name."""
    return discover(f"{__package__}.formats", "FORMAT", ExportFormat, "roboirg.export_formats")


def names_where(has: Callable[[ExportFormat], bool]) -> str:
    """Return the names of the formats for which `has` is true: ``"'robomme-hdf5'"``.

    Several are joined: ``"'lerobot-v2.1' or 'lerobot-v3'"``.
    """
    return " or ".join(repr(known.name) for known in export_formats().values() if has(known))


def find_format(name: str) -> ExportFormat:
    """Return the format of a name.

    Raises:
        UnknownNameError: there is none.
    """
    check_names("format", [name], export_formats())
    return export_formats()[name]
