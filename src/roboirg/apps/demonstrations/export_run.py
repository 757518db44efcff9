"""Run an export: record what is missing, write the parts, then what describes them.

A trajectory is one recorded episode. A part is what is written at once: a file or a few of the
dataset. An episode of the dataset is a trajectory with one instruction.

All work is resumable: trajectories and parts appear under their names only when they are complete,
and what makes the dataset readable is written last.
"""

from __future__ import annotations

import contextlib
import functools
import json
import shutil
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from roboirg.apps.demonstrations import data_card
from roboirg.apps.demonstrations.dataset_part import (
    DatasetPart,
    RecordedInstructions,
    write_episode_table,
)
from roboirg.apps.demonstrations.export_plan import (
    ORACLE,
    ExportPlan,
    RecordingJob,
    SpokenJob,
    recording_jobs,
)
from roboirg.apps.demonstrations.trajectory import (
    TrajectoryFacts,
    drop_pictures,
    has_pictures,
    load_facts,
)
from roboirg.apps.demonstrations.trajectory_recorder import record_trajectory
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.errors import InvalidValueError
from roboirg.core.version import __version__
from roboirg.policies import Policy, make_policy
from roboirg.policies.builtin.waypoint_expert import (
    Disturbance,
    JointWaypointExpert,
    WaypointExpert,
)
from roboirg.util.atomic_write import locked, write_atomically
from roboirg.util.parallel_map import parallel_map
from roboirg.util.parquet_support import check_parquet_support
from roboirg.util.regular_file import read_regular

WORK_FOLDER = ".export"
EXPORT_FILE = "meta/export.json"
"""What was exported, with its fingerprint; written when everything else is complete."""

Report = Callable[[str, int, int, int], None]
"""Called with the kind of work, how much is done, how much there is, and bytes on the disk."""


class ExportSummary(NamedTuple):
    """What an export did.

    Attributes:
        recorded: trajectories recorded by this call.
        statuses: how many trajectories ended how.
        episodes: in the dataset.
        size: of the dataset, bytes.
    """

    recorded: int
    statuses: Mapping[str, int]
    episodes: int
    size: int


def run_export(
    plan: ExportPlan,
    out: Path,
    workers: int,
    report: Report,
    trajectories: Path | None = None,
) -> ExportSummary:
    """Export a plan into a folder, or continue an export that was stopped.

    The order matters: all trajectories first, as parts are numbered over all of them; then parts;
    last what describes the dataset.

    Args:
        plan: what to export.
        out: folder of the dataset, new or of the same plan.
        workers: processes; 0 uses this one.
        report: called with the progress.
        trajectories: folder that keeps the recorded trajectories, for other formats and settings;
            None for one in `out` that is deleted at the end.

    Raises:
        InvalidValueError: the folder holds something else, another export uses it, or no trajectory
            can be exported.
        MissingDependencyError: a package is not installed.
    """
    check_parquet_support("demonstrations")
    plan.file_format.check_support()
    jobs = recording_jobs(plan)
    with _opened(plan, out) as work:
        usable = _Usable(
            plan=plan,
            folder=trajectories or work / "trajectories",
            may_lack_pictures=(work / "parts").exists(),
        )
        recorded = _record_missing(jobs, usable, workers, report)
        facts = [load_facts(spoken.job.path(usable.folder)) for spoken in jobs]
        wanted = _wanted(plan, jobs, facts, usable.folder)
        parts = plan.file_format.make_parts(plan, out, wanted)
        keeps_pictures = trajectories is not None
        _write_parts(parts, work / "parts", workers, report, keeps_pictures=keeps_pictures)
        _finish(plan, out, parts, facts)
    statuses = Counter(trajectory.status for trajectory in facts)
    return ExportSummary(recorded, statuses, _episode_count(parts), folder_size(out))


def _wanted(
    plan: ExportPlan, jobs: Sequence[SpokenJob], facts: Sequence[TrajectoryFacts], folder: Path
) -> list[RecordedInstructions]:
    """Return the files and instructions of the trajectories that the plan exports.

    Args:
        plan: what is exported: all trajectories, or successes only.
        jobs: all trajectories, with their instructions.
        facts: how each of them ended, in the order of `jobs`.
        folder: of the trajectories' files.

    Raises:
        InvalidValueError: none is left.
    """
    found = []
    for spoken, recorded in zip(jobs, facts, strict=True):
        if _is_wanted(plan, recorded):
            path = spoken.job.path(folder)
            found.append(RecordedInstructions(path, spoken.instructions))
    if not found:
        raise InvalidValueError(
            f"None of the {len(jobs)} trajectories is a success; ask for `outcomes: all`."
        )
    return found


def _episode_count(parts: Sequence[DatasetPart]) -> int:
    """Return how many episodes a dataset has: one for each instruction of a trajectory."""
    count = 0
    for part in parts:
        for episode in part.episodes:
            count += len(episode.instructions)
    return count


@contextlib.contextmanager
def _opened(plan: ExportPlan, out: Path) -> Iterator[Path]:
    """Begin or continue an export; yield the folder `out/.export` for its unfinished work.

    The folder is locked, and deleted when the block ends without error. After an error it stays, so
    that the same plan can be continued. Its presence means *not complete*; `plan.json` in it has
    the fingerprint of the plan that was started.

    Raises:
        InvalidValueError: `out` holds other files, a complete export, or one of another plan, or
            another process writes to it.
    """
    work = out / WORK_FOLDER
    written = _read_fingerprint(out / EXPORT_FILE)
    if written is not None and not work.exists():
        raise InvalidValueError(
            f"{str(out)!r} holds a complete export already; choose another folder."
        )
    if out.exists() and not work.exists() and any(out.iterdir()):
        raise InvalidValueError(
            f"{str(out)!r} is not empty and no export that was stopped; choose another folder."
        )
    with locked(work / ".lock", f"Another export writes to {str(out)!r}."):
        started = work / "plan.json"
        started_fingerprint = _read_fingerprint(started)
        if started_fingerprint not in (None, plan.fingerprint()):
            raise InvalidValueError(
                f"The export in {str(out)!r} was started with other options or another version; "
                "give the same ones, or choose another folder."
            )
        write_atomically(started, json.dumps({"fingerprint": plan.fingerprint()}))
        for path in out.rglob(".*.part"):  # what a killed export left
            path.unlink(missing_ok=True)
        yield work
        shutil.rmtree(work)


def _read_fingerprint(path: Path) -> str | None:
    """Return the fingerprint of an export in a file; None if there is none."""
    try:
        return str(json.loads(read_regular(path))["fingerprint"])
    except (OSError, ValueError, KeyError):
        return None


def _record_missing(
    jobs: Sequence[SpokenJob], usable: _Usable, workers: int, report: Report
) -> int:
    """Record the trajectories that are not there yet; return how many these were.

    Args:
        jobs: all trajectories of the plan.
        usable: the folder of trajectories, in which some may be there already.
        workers: worker processes; 0 uses this process only.
        report: called with ``"record"``, the number of trajectories that are done, and of all, and
            the size of their files in bytes.
    """
    usable.folder.mkdir(parents=True, exist_ok=True)
    missing = [spoken.job for spoken in jobs if not usable.has(spoken.job)]
    done = len(jobs) - len(missing)
    size = folder_size(usable.folder)
    report("record", done, len(jobs), size)
    only_successes = usable.plan.outcomes == "successes"
    record_job = functools.partial(_record_job, usable.folder, only_successes=only_successes)
    for job, _ in parallel_map(record_job, missing, workers):
        done += 1
        size += job.path(usable.folder).stat().st_size
        report("record", done, len(jobs), size)
    return len(missing)


def _record_job(folder: Path, job: RecordingJob, *, only_successes: bool) -> None:
    """Play one job's episode and write its trajectory into the folder; runs in a worker process."""
    record_trajectory(
        job.episode,
        choose_policy(job),
        job.path(folder),
        job.spec,
        options=job.options,
        policy_name=job.policy,
        variation=job.variation,
        only_successes=only_successes,
    )


def choose_policy(job: RecordingJob) -> Policy:
    """Return the policy that plays an episode to be recorded.

    The oracle becomes an expert that goes from waypoint to waypoint if these are to be recorded, or
    if it is disturbed on its way; else it is the policy of its name.
    """
    disturbance = Disturbance() if job.spec.disturbed else None
    if job.policy == ORACLE and job.spec.actions == WaypointExpert.actions:
        return WaypointExpert(job.variation, disturbance)
    if disturbance is not None:
        return JointWaypointExpert(job.variation, disturbance)
    return make_policy(job.policy, 0)


class _Usable(NamedTuple):
    """Which trajectories of a folder need not be recorded.

    Attributes:
        plan: of the export.
        folder: of the trajectories.
        may_lack_pictures: whether parts are being written: a trajectory then loses its pictures as
            soon as they have been.
    """

    plan: ExportPlan
    folder: Path
    may_lack_pictures: bool

    def has(self, job: RecordingJob) -> bool:
        """Return whether the folder has a trajectory of this version, with pictures if needed.

        Pictures are not needed if the dataset has none, if it leaves the trajectory out, or if its
        part may be written already.
        """
        path = job.path(self.folder)
        if not path.exists():
            return False
        facts = load_facts(path)
        if facts.environment_version != ENVIRONMENT_VERSION:
            return False
        if self.plan.pictures == "none" or not _is_wanted(self.plan, facts):
            return True
        return self.may_lack_pictures or has_pictures(path)


def _is_wanted(plan: ExportPlan, facts: TrajectoryFacts) -> bool:
    """Return whether a trajectory that ended like this is exported."""
    return plan.outcomes == "all" or facts.status == "success"


def _write_parts(
    parts: Sequence[DatasetPart],
    folder: Path,
    workers: int,
    report: Report,
    *,
    keeps_pictures: bool,
) -> None:
    """Write the parts of the dataset that an earlier call has not written yet.

    A part is marked, by an empty file, after it is written and before its trajectories lose their
    pictures, so that a kill at any moment loses none.

    Args:
        parts: of the dataset, all.
        folder: of the marks.
        workers: worker processes; 0 uses this process only.
        report: called with ``"write"``, the number of parts that are done, and of all, and 0.
        keeps_pictures: whether trajectories keep their pictures when their part is written.
    """
    folder.mkdir(exist_ok=True)
    missing = [part for part in parts if not _mark(folder, part).exists()]
    done = len(parts) - len(missing)
    report("write", done, len(parts), 0)
    for part, _ in parallel_map(_write_part, missing, workers):
        write_atomically(_mark(folder, part), "")
        done += 1
        report("write", done, len(parts), 0)
        if not keeps_pictures:
            for episode in part.episodes:
                drop_pictures(episode.path)


def _mark(folder: Path, part: DatasetPart) -> Path:
    """Return the file whose existence says that a part is complete."""
    return folder / f"{part.number:06d}"


def _write_part(part: DatasetPart) -> None:
    """Write one part in its plan's format; runs in a worker process."""
    part.columns.plan.file_format.write_part(part)


def _finish(
    plan: ExportPlan, out: Path, parts: Sequence[DatasetPart], facts: Sequence[TrajectoryFacts]
) -> None:
    """Write the dataset's card and metadata; last the file that marks it as complete.

    Args:
        plan: what was exported.
        out: folder of the dataset.
        parts: of the dataset, all written.
        facts: of all trajectories, those that were left out, too.
    """
    write_atomically(out / "README.md", data_card.card_text(plan, facts, out))
    write_episode_table(out, parts)
    plan.file_format.finish(out, parts)
    content = {"fingerprint": plan.fingerprint(), "roboirg": __version__, "format": plan.format}
    write_atomically(out / EXPORT_FILE, json.dumps(content, indent=2) + "\n")


def folder_size(folder: Path) -> int:
    """Return the size of all files in a folder, bytes, without unfinished work."""
    size = 0
    for path in folder.rglob("*"):
        is_unfinished = WORK_FOLDER in path.relative_to(folder).parts
        if path.is_file() and not is_unfinished:
            size += path.stat().st_size
    return size
