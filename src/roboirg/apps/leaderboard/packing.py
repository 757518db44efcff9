"""Pack a run into one file for others to check, and open such a file.

A pack is a zip archive with the run's records, plan and actions, its logs and videos if wanted, and
``manifest.json``: versions, and the SHA-256 of every other file. The same run gives the same bytes.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath

from pydantic import BaseModel, ConfigDict

from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import printable
from roboirg.core.version import __version__
from roboirg.evaluation.records.action_log import ACTION_FOLDER, UNREADABLE_ARCHIVE
from roboirg.evaluation.records.episode_log import LOG_FOLDER
from roboirg.evaluation.records.record_codec import StoreError, read_summary
from roboirg.evaluation.records.run_files import (
    EARLIER_PLANS,
    MOST_PATH_LETTERS,
    PLAN_FILE,
    RELATIVE_PATH,
    plan_names,
    run_file,
)
from roboirg.evaluation.records.store import RECORDS_FILE, StoredRun
from roboirg.util.atomic_write import replacing
from roboirg.util.regular_file import open_regular

MANIFEST = "manifest.json"
_PACKED_FOLDERS = {"actions": ACTION_FOLDER, "logs": LOG_FOLDER, "videos": "videos"}
_MAX_BYTES = 20 << 30
"""Most bytes that a pack may hold unpacked."""
_MAX_MANIFEST_BYTES = 64 << 20
_MOST_SHOWN = 200
_EPOCH = (1980, 1, 1, 0, 0, 0)
_BLOCK = 1 << 20


class PackManifest(BaseModel):
    """What a pack says about itself.

    Attributes:
        format: version of packs.
        package_version: of the roboirg that packed the run.
        records: number of episodes.
        policies: names of the policies.
        files: SHA-256 of each file, in hexadecimal, by name.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: int = 1
    package_version: str
    records: int
    policies: tuple[str, ...]
    files: dict[str, str]


def pack_run(folder: Path, out: Path, *, videos: bool = False, logs: bool = False) -> PackManifest:
    """Write a run into one file.

    Args:
        folder: of the run.
        out: file to write; replaced if it exists.
        videos: whether to include the episodes' videos.
        logs: whether to include what policies printed.

    Raises:
        StoreError: there are no records, a line is not a record, or there is too much.
        ForeignPathError: a file is outside of the folder, by a symbolic link, or has an odd name.
        InvalidValueError: the file cannot be written.
    """
    entries = StoredRun(folder, read_summary).newest
    wanted = {"actions", *(["videos"] if videos else []), *(["logs"] if logs else [])}
    names = [RECORDS_FILE, *plan_names(folder)]
    for name in sorted(wanted):
        found = (folder / _PACKED_FOLDERS[name]).rglob("[!.]*")
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
    if sum(sizes.values()) > _MAX_BYTES:
        largest = max(sizes, key=lambda name: sizes[name])
        raise StoreError(
            f"The files of {folder} have {sum(sizes.values()):,} bytes (the largest, {largest}, "
            f"has {sizes[largest]:,}); a pack holds at most {_MAX_BYTES >> 30} GiB."
        )


@contextlib.contextmanager
def opened_run(path: Path) -> Iterator[Path]:
    """Yield the folder of a run: the path itself, or a pack unpacked for the while.

    Raises:
        StoreError: the file is no pack, or one of its files is not what the manifest says.
    """
    if path.is_dir() or not os.path.lexists(path):
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="roboirg-") as name:
        folder = Path(name)
        try:
            with open_regular(path) as file, zipfile.ZipFile(file) as archive:
                _unpack(archive, path, folder)
        except UNREADABLE_ARCHIVE as error:
            words = printable(" ".join(str(error).split()))[:_MOST_SHOWN].rstrip(".")
            raise StoreError(f"{path} is not a packed run: {words}.") from error
        yield folder


def _manifest(archive: zipfile.ZipFile, path: Path) -> PackManifest:
    try:
        if archive.getinfo(MANIFEST).file_size > _MAX_MANIFEST_BYTES:
            raise ValueError("it is too large")
        return PackManifest.model_validate_json(archive.read(MANIFEST))
    except (KeyError, ValueError) as error:
        raise StoreError(f"{path} is not a packed run: its {MANIFEST} cannot be read.") from error


def _unpack(archive: zipfile.ZipFile, path: Path, folder: Path) -> None:
    """Unpack an archive after checking all names and sizes."""
    files = _manifest(archive, path).files
    entries = [one for one in archive.infolist() if one.filename != MANIFEST]
    if sorted(one.filename for one in entries) != sorted(files):
        raise StoreError(f"{path} does not hold exactly the files that its manifest names.")
    if sum(one.file_size for one in entries) > _MAX_BYTES:
        raise StoreError(f"{path} unpacks to more than {_MAX_BYTES >> 30} GiB.")
    for one in entries:
        target = folder / _safe(one.filename, path)
        target.parent.mkdir(parents=True, exist_ok=True)
        digest = hashlib.sha256()
        with archive.open(one) as source, target.open("wb") as file:
            while block := source.read(_BLOCK):
                digest.update(block)
                file.write(block)
        if digest.hexdigest() != files[one.filename]:
            raise StoreError(f"{one.filename} in {path} is not the file that its manifest names.")


def _safe(name: str, path: Path) -> str:
    """Return the name of a file of a run, if it is one; others may lead outside the folder."""
    parts = PurePosixPath(name).parts
    top = parts[0] if parts else ""
    folders = {EARLIER_PLANS, *_PACKED_FOLDERS.values()}
    is_known = name in (RECORDS_FILE, PLAN_FILE) or top in folders
    if not is_known or len(name) > MOST_PATH_LETTERS or not re.fullmatch(RELATIVE_PATH, name):
        shown = printable(name[:_MOST_SHOWN])
        raise StoreError(f"{path} holds {shown!r}, which does not belong to a run.")
    return name


def _file_hash(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal.

    Raises:
        InvalidValueError: it cannot be read.
    """
    try:
        with open_regular(path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InvalidValueError(f"Cannot read {path}: {error.strerror}.") from error
