"""Pack a run into one file for others to check; the same run gives the same bytes."""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Mapping
from pathlib import Path

from roboirg.core.errors import InvalidValueError
from roboirg.core.version import __version__
from roboirg.evaluation.records.action_log import ACTION_FOLDER
from roboirg.evaluation.records.episode_log import LOG_FOLDER
from roboirg.evaluation.records.film import VIDEO_FOLDER
from roboirg.evaluation.records.packs import MANIFEST, MOST_PACKED_BYTES, PackManifest
from roboirg.evaluation.records.record_codec import StoreError, read_summary
from roboirg.evaluation.records.run_files import plan_names, run_file
from roboirg.evaluation.records.store import RECORDS_FILE, StoredRun
from roboirg.util.atomic_write import replacing
from roboirg.util.regular_file import file_hash

_EPOCH = (1980, 1, 1, 0, 0, 0)
_BLOCK = 1 << 20


def pack_run(folder: Path, out: Path, *, videos: bool = False, logs: bool = False) -> PackManifest:
    """Write a run into one file.

    Args:
        folder: of the run.
        out: file to write; replaced if it exists.
        videos: whether to include the episodes' videos.
        logs: whether to include what policies printed.

    Raises:
        StoreError: there are no records, a line is damaged or no record, or there is too much.
        ForeignPathError: a file is outside of the folder, by a symbolic link, or has an odd name.
        InvalidValueError: the file cannot be written.
    """
    run = StoredRun(folder, read_summary)
    run.file.refuse_damage()
    entries = run.newest
    wanted = [ACTION_FOLDER, *[LOG_FOLDER] * logs, *[VIDEO_FOLDER] * videos]
    names = [RECORDS_FILE, *plan_names(folder)]
    for name in wanted:
        found = (folder / name).rglob("[!.]*")
        names += sorted(path.relative_to(folder).as_posix() for path in found if path.is_file())
    paths = {name: run_file(folder, name) for name in names}
    _check_size(paths, folder)
    manifest = PackManifest(
        package_version=__version__,
        records=len(entries),
        policies=tuple(sorted({one.policy for one in entries})),
        files={name: _file_hash(path) for name, path in paths.items()},
    )
    with replacing(out) as part, zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo(MANIFEST, _EPOCH), manifest.model_dump_json(indent=1))
        for name, path in paths.items():
            entry = zipfile.ZipInfo(name, _EPOCH)
            # Actions and videos are compressed already.
            packed = name.endswith((".npz", ".mp4", ".jpg"))
            entry.compress_type = zipfile.ZIP_STORED if packed else zipfile.ZIP_DEFLATED
            with path.open("rb") as file, archive.open(entry, "w", force_zip64=True) as target:
                shutil.copyfileobj(file, target, _BLOCK)
    return manifest


def _check_size(paths: Mapping[str, Path], folder: Path) -> None:
    """Refuse a run whose pack could not be opened again."""
    sizes = {name: path.stat().st_size for name, path in paths.items()}
    if sum(sizes.values()) > MOST_PACKED_BYTES:
        largest = max(sizes, key=lambda name: sizes[name])
        raise StoreError(
            f"The files of {folder} have {sum(sizes.values()):,} bytes (the largest, {largest}, "
            f"has {sizes[largest]:,}); a pack holds at most {MOST_PACKED_BYTES >> 30} GiB."
        )


def _file_hash(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal.

    Raises:
        InvalidValueError: it cannot be read.
    """
    try:
        return file_hash(path)
    except OSError as error:
        raise InvalidValueError(f"Cannot read {path}: {error.strerror}.") from error
