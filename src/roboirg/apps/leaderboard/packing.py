"""Pack a run into one file for others to check; the same run gives the same bytes."""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Mapping
from pathlib import Path

from roboirg.core.errors import InvalidValueError
from roboirg.core.version import __version__
from roboirg.records.action_log import ACTION_FOLDER
from roboirg.records.episode_log import LOG_FOLDER
from roboirg.records.film import VIDEO_FOLDER
from roboirg.records.packs import MANIFEST, MOST_PACKED_BYTES, PackManifest
from roboirg.records.record_codec import StoreError, read_summary
from roboirg.records.run_files import plan_names, run_file
from roboirg.records.store import RECORDS_FILE, StoredRun
from roboirg.util.atomic_write import replacing
from roboirg.util.regular_file import file_hash

_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The time of every file in a pack, the earliest that the format has."""
_BLOCK = 2**20
"""Bytes of a file that are copied at once."""
_COMPRESSED = (".npz", ".mp4", ".jpg")
"""Ends the names of files that would not become smaller."""
_GIB = 2**30


def pack_run(folder: Path, out: Path, *, videos: bool = False, logs: bool = False) -> PackManifest:
    """Write the records, plans and actions of a run into one file, a pack; return its manifest.

    The manifest lists every file with its hash, so that a reader can check that none was changed.

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
    names = _names_to_pack(folder, videos=videos, logs=logs)
    paths = {name: run_file(folder, name) for name in names}
    _check_size(paths, folder)
    policies = {entry.policy for entry in run.newest}
    manifest = PackManifest(
        package_version=__version__,
        records=len(run.newest),
        policies=tuple(sorted(policies)),
        files={name: _file_hash(path) for name, path in paths.items()},
    )
    _write(out, manifest, paths)
    return manifest


def _names_to_pack(folder: Path, *, videos: bool, logs: bool) -> list[str]:
    """Return the files of a run that go into a pack, by their paths in the run, in a fixed order.

    Records, plans and actions always, logs and videos if they are wanted.
    """
    names = [RECORDS_FILE, *plan_names(folder), *_names_below(folder, ACTION_FOLDER)]
    if logs:
        names += _names_below(folder, LOG_FOLDER)
    if videos:
        names += _names_below(folder, VIDEO_FOLDER)
    return names


def _names_below(folder: Path, name: str) -> list[str]:
    """Return the files below a folder of a run, sorted, by their paths in the run.

    ``"actions"`` -> ``["actions/1a/2b.npz", …]``; hidden ones are left out.
    """
    names = []
    for path in (folder / name).rglob("[!.]*"):
        if path.is_file():
            names.append(path.relative_to(folder).as_posix())
    return sorted(names)


def _write(out: Path, manifest: PackManifest, paths: Mapping[str, Path]) -> None:
    """Write manifest and files into a pack, a ZIP file, in the order of `paths`.

    Every entry gets the same date, so that the same files give the same bytes.
    """
    with replacing(out) as part, zipfile.ZipFile(part, "w") as archive:
        archive.writestr(zipfile.ZipInfo(MANIFEST, _EPOCH), manifest.model_dump_json(indent=1))
        for name, path in paths.items():
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_LZMA
            if name.endswith(_COMPRESSED):  # packing it again would save nothing
                entry.compress_type = zipfile.ZIP_STORED
            with path.open("rb") as file, archive.open(entry, "w", force_zip64=True) as target:
                shutil.copyfileobj(file, target, _BLOCK)


def _check_size(paths: Mapping[str, Path], folder: Path) -> None:
    """Raise if the files are larger in all than the most that is unpacked from a pack.

    Args:
        paths: of the files, by their names in the pack.
        folder: of the run, for the error.

    Raises:
        StoreError: they are; the message names the largest.
    """
    sizes = {name: path.stat().st_size for name, path in paths.items()}
    total = sum(sizes.values())
    if total > MOST_PACKED_BYTES:
        largest = max(sizes, key=lambda name: sizes[name])
        raise StoreError(
            f"The files of {folder} have {total:,} bytes (the largest, {largest}, "
            f"has {sizes[largest]:,}); a pack holds at most {MOST_PACKED_BYTES // _GIB} GiB."
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
